#include <filesystem>
#include <memory>
#include <ostream>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/report_error.h"

namespace posed {
namespace {

int run_check_config(const std::filesystem::path& path, const Console& console) {
  if (!std::filesystem::exists(path)) {
    return report_error(console.err, {ErrorCode::NotFound, fmt::format("there is no file {}", path.string())});
  }
  const Result<Config> config = load_config(path);
  if (!config) {
    return report_error(console.err, config.error());
  }
  fmt::print(console.out, "{}: correct (camera {}: {}x{})\n", path.string(), config->camera.calibration, config->intrinsics.width,
             config->intrinsics.height);
  return kExitOk;
}

}  // namespace

void add_check_config_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto path = std::make_shared<std::filesystem::path>();
  CLI::App* command =
      parent.add_subcommand("check-config", "Check a configuration file and the calibration it names, as the daemon would");
  command->add_option("file", *path, "Configuration file (TOML)")->required();
  command->callback([path, &console, &exit_code] { exit_code = run_check_config(*path, console); });
}

}  // namespace posed
