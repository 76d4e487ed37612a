#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "drivers/gpio_listing.h"
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

/// A line of text for each chip, and for each of its lines that has a name or somebody who has it.
void list_gpio([[maybe_unused]] FoundDevices& devices, [[maybe_unused]] const Console& console) {
#ifdef POSED_HAS_GPIO
  devices.gpio_built = true;
  const Result<std::vector<ListedGpioChip>> chips = list_gpio_chips();
  if (!chips) {
    report_error(console.err, chips.error());
    return;
  }
  for (const ListedGpioChip& chip : *chips) {
    devices.gpio.push_back(fmt::format("{} ({}), {} lines", chip.name, chip.label, chip.lines.size()));
    for (std::size_t i = 0; i < chip.lines.size(); ++i) {
      const ListedGpioLine& line = chip.lines[i];
      if (!line.name.empty() || line.used) {
        devices.gpio.push_back(
            fmt::format("  {}: {}{}", i, line.name.empty() ? "unnamed" : line.name,
                        line.used ? fmt::format(", in use by {}", line.consumer.empty() ? "somebody" : line.consumer) : ""));
      }
    }
  }
#endif
}

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
  list_gpio(devices, console);
  fmt::print(console.out, "{}", options.json ? devices_json(devices) : format_devices(devices));
  const bool any = !devices.gpio.empty() || std::any_of(devices.cameras.begin(), devices.cameras.end(),
                                                        [](const DriverListing& l) { return !l.cameras.empty(); });
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
