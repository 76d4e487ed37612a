#include "tools/posectl/posectl.h"

#include <algorithm>
#include <exception>
#include <ostream>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "tools/posectl/exit_code.h"

namespace posed {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done; 1 done, and the answer is no (nothing tracked, too few poses to compare, messages missing);\n"
    "64 wrong command line; 65 malformed input; 66 no such input; 69 a service or a part of this build is missing;\n"
    "74 reading or writing failed; 78 wrong configuration or calibration file.";

int parse_and_run(std::vector<std::string> arguments, const Console& console) {
  CLI::App app("Tools around the pose daemon posed: replay, evaluate, watch, synthesise, record, detect.", "posectl");
  int exit_code = kExitOk;
  app.require_subcommand(1);
  app.footer(kExitCodes);
  add_replay_command(app, console, exit_code);
  add_eval_command(app, console, exit_code);
  add_watch_command(app, console, exit_code);
  add_synth_command(app, console, exit_code);
  add_record_command(app, console, exit_code);
  add_devices_command(app, console, exit_code);
  add_calibrate_command(app, console, exit_code);
  add_detect_command(app, console, exit_code);
  add_model_command(app, console, exit_code);
  add_check_config_command(app, console, exit_code);
  add_doctor_command(app, console, exit_code);
  add_bench_command(app, console, exit_code);
  add_version_command(app, console, exit_code);
  // CLI11 takes a vector from its back.
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    return app.exit(error, console.out, console.err) == 0 ? kExitOk : kExitUsage;
  }
  return exit_code;
}

}  // namespace

int run_posectl(std::vector<std::string> arguments, const Console& console) {
  try {
    return parse_and_run(std::move(arguments), console);
  } catch (const std::exception& error) {
    fmt::print(console.err, "posectl: {}\n", error.what());
    return kExitIo;
  }
}

}  // namespace posed
