#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "core/clock.h"
#include "daemon/app.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/estimate_recorder.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/replay_config.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/trajectory_error.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

constexpr TimeNs kWaitPeriod_ns = 50 * kNsPerMs;

struct BenchOptions {
  std::filesystem::path root;
  std::filesystem::path camera;
  std::filesystem::path config;
  std::filesystem::path csv;
  std::vector<DynamicMode> modes{DynamicMode::Off, DynamicMode::Full};
  int runs = 1;
  bool realtime = false;
  bool quiet = false;
};

const char* name_of(DynamicMode mode) {
  switch (mode) {
    case DynamicMode::Off: return "off";
    case DynamicMode::Boxes: return "boxes";
    case DynamicMode::Full: return "full";
  }
  return "?";
}

/// One replay, judged.
struct Run {
  ErrorStatistics ate_m;
  double tracked = 0;  ///< share of the frames
  LatencySummary track;
};

/// One row: a sequence in one mode; the run with the median RMSE.
struct Row {
  std::string sequence;
  DynamicMode mode = DynamicMode::Off;
  Run run;
  std::optional<double> improvement;  ///< of the RMSE over `off`, 1: all of it gone
};

bool is_sequence(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "rgb.txt", ignored) && std::filesystem::exists(folder / "depth.txt", ignored) &&
         std::filesystem::exists(folder / "groundtruth.txt", ignored);
}

/// `root` itself or the folders right in it, by name.
Result<std::vector<std::filesystem::path>> find_sequences(const std::filesystem::path& root) {
  std::vector<std::filesystem::path> found;
  if (is_sequence(root)) {
    found.push_back(root);
  }
  std::error_code failed;
  for (std::filesystem::directory_iterator at(root, failed), end; !failed && at != end; at.increment(failed)) {
    if (is_sequence(at->path())) {
      found.push_back(at->path());
    }
  }
  if (failed) {
    return make_error(ErrorCode::Io, fmt::format("{}: {}", root.string(), failed.message()));
  }
  if (found.empty()) {
    return make_error(ErrorCode::NotFound,
                      fmt::format("{}: no folder in it has rgb.txt, depth.txt and groundtruth.txt", root.string()));
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// The camera that a sequence of the TUM benchmark was taken with, by its folder's name.
Result<std::filesystem::path> camera_of(const BenchOptions& options, const std::filesystem::path& sequence) {
  if (!options.camera.empty()) {
    return options.camera;
  }
  const std::string name = sequence.filename().string();
  for (const char number : {'1', '2', '3'}) {
    for (const char* const prefix : {"freiburg", "fr"}) {
      if (name.find(std::string(prefix) + number) != std::string::npos) {
        return std::filesystem::path(fmt::format("tum_fr{}.toml", number));
      }
    }
  }
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("{}: its name tells no camera (fr1, fr2 or fr3): give --camera FILE", sequence.string()));
}

Result<Run> run_once(const Config& config, const std::filesystem::path& sequence, const InterruptGuard& interrupt) {
  std::optional<EstimateRecorder> recorder;
  std::optional<Error> source_error;
  AppOptions app_options;
  app_options.publish = false;
  app_options.map_files = MapFiles{};
  app_options.on_estimate = [&recorder](const PoseEstimate& estimate) { recorder->record(estimate); };
  const Result<std::unique_ptr<App>> app = App::create(config, app_options, SystemClock::instance());
  if (!app) {
    return tl::unexpected(app.error());
  }
  recorder.emplace((*app)->source_info().total_frames);
  if (const Status started = (*app)->start(); !started) {
    return tl::unexpected(started.error());
  }
  while (!(*app)->wait_finished(kWaitPeriod_ns) && !interrupt.requested()) {
  }
  (*app)->stop();
  const HealthReport health = (*app)->health();
  if (interrupt.requested()) {
    return make_error(ErrorCode::Unavailable, "interrupted");
  }
  if (health.source_failed) {
    return make_error(ErrorCode::BadData, fmt::format("{}: the recording could not be read to its end", sequence.string()));
  }
  const Result<Trajectory> truth = read_trajectory(sequence / "groundtruth.txt");
  if (!truth) {
    return tl::unexpected(truth.error());
  }
  const auto keyframe_pose = [&app](std::uint64_t keyframe) { return (*app)->keyframe_pose(keyframe); };
  const Result<TrajectoryError> error = evaluate_trajectory(*truth, recorder->final_trajectory(keyframe_pose).trajectory, {});
  if (!error) {
    return make_error(error.error().code, fmt::format("{}: {}", sequence.string(), error.error().message));
  }
  const auto frames = static_cast<double>(std::max<std::size_t>(1, recorder->frames().size()));
  return Run{error->ate_m, static_cast<double>(health.frames_tracked) / frames, health.track};
}

Result<Row> run_mode(const BenchOptions& options, const std::filesystem::path& sequence, DynamicMode mode,
                     const InterruptGuard& interrupt) {
  const Result<std::filesystem::path> camera = camera_of(options, sequence);
  if (!camera) {
    return tl::unexpected(camera.error());
  }
  ReplaySource source;
  source.config = options.config;
  source.camera = *camera;
  source.sequence = sequence;
  source.lockstep = !options.realtime;
  source.dynamic = mode;
  Result<Config> config = make_replay_config(source);
  if (!config) {
    return tl::unexpected(config.error());
  }
  config->detector.enabled = config->detector.enabled && mode != DynamicMode::Off;
  std::vector<Run> runs;
  for (int i = 0; i < options.runs; ++i) {
    const Result<Run> run = run_once(*config, sequence, interrupt);
    if (!run) {
      return tl::unexpected(run.error());
    }
    runs.push_back(*run);
  }
  std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.ate_m.rmse < b.ate_m.rmse; });
  return Row{sequence.filename().string(), mode, runs[(runs.size() - 1) / 2], std::nullopt};
}

std::string to_markdown(const std::vector<Row>& rows) {
  std::string text =
      "| sequence | mode | tracked | RMSE [m] | median [m] | mean [m] | std [m] | improvement | track p50, p99 [ms] |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const Row& row : rows) {
    const ErrorStatistics& e = row.run.ate_m;
    text += fmt::format("| {} | {} | {:.1f} % | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {} | {:.1f}, {:.1f} |\n", row.sequence,
                        name_of(row.mode), 100 * row.run.tracked, e.rmse, e.median, e.mean, e.std,
                        row.improvement ? fmt::format("{:.1f} %", 100 * *row.improvement) : "", row.run.track.p50_ms,
                        row.run.track.p99_ms);
  }
  return text;
}

std::string to_csv(const std::vector<Row>& rows) {
  std::string text = "sequence,mode,tracked,rmse_m,median_m,mean_m,std_m,improvement,track_p50_ms,track_p99_ms\n";
  for (const Row& row : rows) {
    const ErrorStatistics& e = row.run.ate_m;
    text += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{},{:.3f},{:.3f}\n", row.sequence, name_of(row.mode),
                        row.run.tracked, e.rmse, e.median, e.mean, e.std,
                        row.improvement ? fmt::format("{:.6f}", *row.improvement) : "", row.run.track.p50_ms, row.run.track.p99_ms);
  }
  return text;
}

int run_bench(const BenchOptions& options, const Console& console) {
  if (const Status status = options.csv.empty() ? Status{} : check_writable(options.csv); !status) {
    return report_error(console.err, status.error());
  }
  const Result<std::vector<std::filesystem::path>> sequences = find_sequences(options.root);
  if (!sequences) {
    return report_error(console.err, sequences.error());
  }
  const InterruptGuard interrupt;
  std::vector<Row> rows;
  int worst = kExitOk;
  for (const std::filesystem::path& sequence : *sequences) {
    std::optional<double> baseline;
    for (const DynamicMode mode : options.modes) {
      if (!options.quiet) {
        fmt::print(console.err, "{}, {}\n", sequence.filename().string(), name_of(mode));
      }
      Result<Row> row = run_mode(options, sequence, mode, interrupt);
      if (!row) {
        worst = report_error(console.err, row.error());  // the other sequences are still worth their time
        if (interrupt.requested()) {
          return worst;
        }
        continue;
      }
      if (mode == DynamicMode::Off) {
        baseline = row->run.ate_m.rmse;
      } else if (baseline) {
        row->improvement = 1 - row->run.ate_m.rmse / *baseline;
      }
      rows.push_back(*row);
    }
  }
  fmt::print(console.out, "{}", to_markdown(rows));
  if (const Status written = options.csv.empty() ? Status{} : write_whole_file(options.csv, to_csv(rows)); !written) {
    return report_error(console.err, written.error());
  }
  return worst;
}

}  // namespace

void add_bench_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* bench = parent.add_subcommand("bench", "Measure on recordings with ground truth");
  bench->require_subcommand(1);
  CLI::App* tum =
      bench->add_subcommand("tum", "Replay every sequence of the TUM RGB-D layout in a folder, in each mode, and print a table");
  const std::map<std::string, DynamicMode> modes{
      {"off", DynamicMode::Off}, {"boxes", DynamicMode::Boxes}, {"full", DynamicMode::Full}};
  tum->add_option("--root", options->root, "Folder of sequences, or one sequence")->required()->check(CLI::ExistingDirectory);
  tum->add_option("--camera", options->camera, "Calibration of all of them; else by their names: fr1, fr2, fr3");
  tum->add_option("--config", options->config, "The daemon's configuration (TOML)");
  tum->add_option("--dynamic", options->modes, "Modes, separated by commas: off, boxes, full; off,full unless given")
      ->delimiter(',')
      ->transform(CLI::CheckedTransformer(modes));
  tum->add_option("--runs", options->runs,
                  "Replays of each; the one with the median RMSE is shown. 1 unless given: lockstep repeats itself")
      ->check(CLI::Range(1, 1000));
  tum->add_flag("--realtime", options->realtime, "At the pace of the stamps instead of in lockstep");
  tum->add_option("--csv", options->csv, "Write the table there, too");
  tum->add_flag("--quiet", options->quiet, "No progress");
  tum->callback([options, &console, &exit_code] { exit_code = run_bench(*options, console); });
}

}  // namespace posed
