#pragma once

#include <iosfwd>

#include <CLI/App.hpp>

/// The subcommands: each adds itself to the command line and, where it is the one that was asked for, runs in CLI11's callback and
/// leaves its exit code. Thread-bound.
namespace posed {

/// Where a command prints and what it returns.
struct Console {
  std::ostream& out;             ///< results
  std::ostream& err;             ///< progress and errors
  bool out_is_terminal = false;  ///< may be redrawn in place
  bool err_is_terminal = false;
};

void add_eval_command(CLI::App& parent, const Console& console, int& exit_code);
void add_replay_command(CLI::App& parent, const Console& console, int& exit_code);
void add_watch_command(CLI::App& parent, const Console& console, int& exit_code);
void add_synth_command(CLI::App& parent, const Console& console, int& exit_code);
void add_record_command(CLI::App& parent, const Console& console, int& exit_code);
void add_devices_command(CLI::App& parent, const Console& console, int& exit_code);
void add_calibrate_command(CLI::App& parent, const Console& console, int& exit_code);
void add_detect_command(CLI::App& parent, const Console& console, int& exit_code);
void add_model_command(CLI::App& parent, const Console& console, int& exit_code);
void add_check_config_command(CLI::App& parent, const Console& console, int& exit_code);
void add_doctor_command(CLI::App& parent, const Console& console, int& exit_code);
void add_bench_command(CLI::App& parent, const Console& console, int& exit_code);
void add_version_command(CLI::App& parent, const Console& console, int& exit_code);

}  // namespace posed
