#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/trajectory.h"
#include "tools/posectl/trajectory_error.h"
#include "tools/posectl/trajectory_plot.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

struct EvalOptions {
  std::filesystem::path truth;
  std::filesystem::path estimate;
  std::filesystem::path frames;
  std::filesystem::path json;
  std::filesystem::path plot;
  double limit_s = TrajectoryErrorOptions{}.pairing_limit_s;
};

void print_table(const TrajectoryError& error, std::ostream& out) {
  const ErrorStatistics& ate = error.ate_m;
  fmt::print(out, "poses      {} paired, coverage {:.1f} %\n", error.pairs.size(), 100.0 * error.coverage);
  fmt::print(out, "ATE [m]    rmse {:.5f}  mean {:.5f}  median {:.5f}  std {:.5f}  max {:.5f}\n", ate.rmse, ate.mean, ate.median,
             ate.std, ate.max);
  if (error.rpe) {
    fmt::print(out, "RPE (1 s)  rmse {:.5f} m  {:.4f} deg over {} intervals\n", error.rpe->translation_rmse_m,
               error.rpe->rotation_rmse_deg, error.rpe->intervals);
  } else {
    fmt::print(out, "RPE (1 s)  no two poses are one second apart\n");
  }
}

Result<TrajectoryError> evaluate(const EvalOptions& options, const Trajectory& truth) {
  const Result<Trajectory> estimate = read_trajectory(options.estimate);
  if (!estimate) {
    return tl::unexpected(estimate.error());
  }
  TrajectoryErrorOptions error_options;
  error_options.pairing_limit_s = options.limit_s;
  if (!options.frames.empty()) {
    const Result<std::vector<std::int64_t>> frames = read_frame_stamps(options.frames);
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    error_options.frames = frames->size();
  }
  return evaluate_trajectory(truth, *estimate, error_options);
}

int run_eval(const EvalOptions& options, const Console& console) {
  for (const std::filesystem::path& output : {options.json, options.plot}) {
    if (const Status status = output.empty() ? Status{} : check_writable(output); !status) {
      return report_error(console.err, status.error());
    }
  }
  const Result<Trajectory> truth = read_trajectory(options.truth);
  if (!truth) {
    return report_error(console.err, truth.error());
  }
  const Result<TrajectoryError> error = evaluate(options, *truth);
  if (!error) {
    report_error(console.err, error.error());
    return error.error().code == ErrorCode::InvalidArgument ? kExitNegative : exit_code_of(error.error().code);
  }
  print_table(*error, console.out);
  if (const Status status = options.json.empty() ? Status{} : write_whole_file(options.json, to_json(*error)); !status) {
    return report_error(console.err, status.error());
  }
  if (const Status status = options.plot.empty() ? Status{} : write_whole_file(options.plot, plot_trajectories(*truth, *error));
      !status) {
    return report_error(console.err, status.error());
  }
  return kExitOk;
}

}  // namespace

void add_eval_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<EvalOptions>();
  CLI::App* command = parent.add_subcommand("eval", "Compare an estimated trajectory with the true one (both in TUM format)");
  command->add_option("groundtruth", options->truth, "True trajectory")->required();
  command->add_option("estimate", options->estimate, "Estimated trajectory")->required();
  command->add_option("--frames", options->frames,
                      "The sequence's rgb.txt: coverage is then the share of its frames that have a pose");
  command->add_option("--limit", options->limit_s, "Stamps farther apart are not paired [s]")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command->add_option("--json", options->json, "Write the figures to this file");
  command->add_option("--plot", options->plot, "Draw both trajectories to this SVG file");
  command->callback([options, &console, &exit_code] { exit_code = run_eval(*options, console); });
}

}  // namespace posed
