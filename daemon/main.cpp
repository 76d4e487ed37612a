#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <sysexits.h>
#include <utility>

#include <CLI/CLI.hpp>

#include "config/config_loader.h"
#include "core/logging.h"
#include "daemon/app.h"
#include "daemon/exit_code.h"
#include "daemon/supervisor.h"
#include "daemon/thread_config.h"
#include "daemon/version.h"
#include "drivers/gpio_lines.h"

namespace {

using namespace posed;

struct Arguments {
  std::filesystem::path config;
  bool check_config = false;
  bool exit_at_end = false;
};

int fail(const Error& error, int code) {
  log_error("{}", error.message);
  return code;
}

int fail(const Error& error) {
  return fail(error, exit_code(error.code));
}

int run_daemon(const Config& config, bool exit_at_end) {
  if (const Status blocked = Supervisor::block_signals(); !blocked) {
    return fail(blocked.error());
  }
  SupervisorOptions supervisor_options;
  supervisor_options.exit_at_end = exit_at_end;
  Supervisor supervisor(supervisor_options);

  std::unique_ptr<GpioLines> gpio;
  if (!config.gpio.chip.empty()) {
    // It gives the camera its time, so it runs as urgently as the thread that takes the camera's frames.
    Result<std::unique_ptr<GpioLines>> made = make_gpio_lines(config.gpio, thread_options("gpio", config.pipeline.capture),
                                                              SystemClock::instance(), supervisor.gpio_error_sink());
    if (!made) {
      return fail(made.error());
    }
    gpio = std::move(*made);
  }

  AppOptions app_options;
  app_options.on_source_error = supervisor.source_error_sink();
  app_options.gpio = gpio.get();
  const Result<std::unique_ptr<App>> app = App::create(config, std::move(app_options), SystemClock::instance());
  if (!app) {
    return fail(app.error());
  }
  const Result<RunEnd> end = supervisor.run(**app, gpio.get());
  if (!end) {
    return fail(end.error());
  }
  return *end == RunEnd::SourceFailed ? EX_UNAVAILABLE : EX_OK;
}

int run(const Arguments& arguments) {
  const Result<Config> config = arguments.config.empty() ? default_config() : load_config(arguments.config);
  if (!config) {
    return fail(config.error(), EX_CONFIG);
  }
  const Result<LogLevel> level = parse_log_level(config->logging.level);
  if (!level) {
    return fail(level.error(), EX_CONFIG);
  }
  if (arguments.check_config) {
    std::printf("%s: ok\n", arguments.config.empty() ? "built-in defaults" : arguments.config.c_str());
    return EX_OK;
  }
  set_log_level(*level);
  return run_daemon(*config, arguments.exit_at_end);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App cli("posed: tracks an RGB-D camera and publishes its pose over LCM", "posed");
  cli.add_option("--config", arguments.config, "Configuration file (TOML); without it the built-in defaults")->type_name("FILE");
  cli.add_flag("--check-config", arguments.check_config, "Check the configuration, print what is wrong with it, and exit");
  cli.add_flag("--exit-at-end", arguments.exit_at_end, "End when the source has ended, instead of waiting for a signal");
  cli.set_version_flag("--version", "posed " + std::string(version()));
  cli.footer(std::string(exit_code_table()));
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  try {
    return run(arguments);
  } catch (const std::exception& error) {
    log_error("internal error, please report it: {}", error.what());
    return EX_SOFTWARE;
  }
}
