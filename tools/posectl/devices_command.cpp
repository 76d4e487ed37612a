#include <algorithm>
#include <memory>
#include <ostream>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "tools/posectl/commands.h"
#include "tools/posectl/device_report.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/report_error.h"

namespace posed {
namespace {

struct DevicesOptions {
  bool config = false;
  bool json = false;
};

int run_devices(const DevicesOptions& options, const Console& console) {
  FoundDevices devices;
  devices.cameras = list_cameras();
  if (options.config) {
    const Result<std::string> config = suggest_config(devices.cameras);
    if (!config) {
      return report_error(console.err, config.error());
    }
    fmt::print(console.out, "{}", *config);
    return kExitOk;
  }
  fmt::print(console.out, "{}", options.json ? devices_json(devices) : format_devices(devices));
  const bool any =
      std::any_of(devices.cameras.begin(), devices.cameras.end(), [](const DriverListing& l) { return !l.cameras.empty(); });
  return any ? kExitOk : kExitNegative;
}

}  // namespace

void add_devices_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<DevicesOptions>();
  CLI::App* command = parent.add_subcommand("devices", "List the cameras and GPIO lines of this machine");
  CLI::Option* config = command->add_flag("--config", options->config,
                                          "Print a configuration to start from, for the best RGB-D camera that is found");
  command->add_flag("--json", options->json, "Print one JSON object")->excludes(config);
  command->callback([options, &console, &exit_code] { exit_code = run_devices(*options, console); });
}

}  // namespace posed
