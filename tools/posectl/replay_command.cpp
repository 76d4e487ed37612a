#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "core/clock.h"
#include "daemon/app.h"
#include "drivers/synthetic_camera.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/estimate_recorder.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/mask_report.h"
#include "tools/posectl/progress.h"
#include "tools/posectl/replay_config.h"
#include "tools/posectl/replay_stats.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/source_errors.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

constexpr TimeNs kWaitPeriod_ns = 50 * kNsPerMs;
constexpr std::size_t kFramesWhereUnknown = 100'000;  // room for an hour's poses

struct ReplayOptions {
  ReplaySource source;
  std::filesystem::path trajectory;
  std::filesystem::path online_trajectory;
  std::filesystem::path stats;
  std::filesystem::path groundtruth;
  std::filesystem::path detections;
  MaskReport::Options masks;
  std::filesystem::path map_in;
  std::filesystem::path map_out;
  bool localization_only = false;
  bool publish = false;
  bool quiet = false;

  std::vector<std::filesystem::path> outputs() const {
    return {trajectory, online_trajectory, stats, groundtruth, detections, map_out};
  }
};

std::uint64_t frames_done(const HealthReport& health) {
  return health.frames_tracked + health.frames_lost + frames_dropped(health) + health.frames_skipped;
}

/// Runs the pipeline until the source has ended or the user wants no more.
Result<ReplayStats> run_to_end(App& app, const ReplayOptions& options, const Console& console) {
  const Clock& clock = SystemClock::instance();
  const TimeNs start_ns = clock.now_ns();
  const InterruptGuard interrupt;
  ReplayStats stats;
  stats.source = app.source_info();
  stats.lockstep = options.source.lockstep;
  ProgressReporter progress(console.err, progress_style(console.err_is_terminal, options.quiet), "replay",
                            stats.source.total_frames, start_ns);
  if (const Status status = app.start(); !status) {
    return tl::unexpected(status.error());
  }
  while (!app.wait_finished(kWaitPeriod_ns) && !interrupt.requested()) {
    progress.update(frames_done(app.health()), clock.now_ns());
  }
  stats.interrupted = interrupt.requested();
  app.stop();
  stats.wall_s = to_seconds(clock.now_ns() - start_ns);
  stats.health = app.health();
  progress.finish(frames_done(stats.health), clock.now_ns());
  return stats;
}

/// The true pose of every frame that the tracker saw: the synthetic camera's own, by the frame's number.
Result<Trajectory> synthetic_truth(const Config& config, const EstimateRecorder& recorder) {
  const Result<std::unique_ptr<SyntheticCamera>> camera = SyntheticCamera::create(config.source.synthetic, config.intrinsics);
  if (!camera) {
    return tl::unexpected(camera.error());
  }
  Trajectory truth;
  truth.reserve(recorder.frames().size());
  for (const EstimateRecorder::Frame& frame : recorder.frames()) {
    truth.push_back({frame.stamp_utc_ns, (*camera)->pose(frame.sequence)});
  }
  return truth;
}

Status write_truth(const std::filesystem::path& path, const Config& config, const EstimateRecorder& recorder) {
  return synthetic_truth(config, recorder).and_then([&path](const Trajectory& truth) {
    return write_whole_file(path, format_trajectory(truth));
  });
}

Status write_outputs(const ReplayOptions& options, const ReplayStats& stats, const EstimateRecorder& recorder, const App& app,
                     std::ostream& err) {
  const EstimateRecorder::Final final_poses =
      recorder.final_trajectory([&app](std::uint64_t keyframe) { return app.keyframe_pose(keyframe); });
  if (final_poses.without_keyframe > 0) {
    fmt::print(err, "posectl: {} poses are not in the final trajectory: the map does not know their keyframe\n",
               final_poses.without_keyframe);
  }
  const auto write = [](const std::filesystem::path& path, const std::string& text) {
    return path.empty() ? Status{} : write_whole_file(path, text);
  };
  return write(options.trajectory, format_trajectory(final_poses.trajectory))
      .and_then([&] { return write(options.online_trajectory, format_trajectory(recorder.online_trajectory())); })
      .and_then([&] { return write(options.stats, to_json(stats)); });
}

/// One line a person: stamp of the frame [s], confidence, box [pixels].
void append_detections(const Detections& detections, std::string& text) {
  for (const Detection& d : detections.found()) {
    text +=
        fmt::format("{}.{:06d} {:.6f} {:.2f} {:.2f} {:.2f} {:.2f}\n", detections.stamp_utc_ns / kNsPerSecond,
                    detections.stamp_utc_ns % kNsPerSecond / kNsPerUs, d.score, d.box.x_min, d.box.y_min, d.box.x_max, d.box.y_max);
  }
}

/// What can be known to be wrong before anything runs.
Status check_before_run(const ReplayOptions& options, const Config& config) {
  if (!options.groundtruth.empty() && config.source.kind != SourceKind::Synthetic) {
    return make_error(ErrorCode::InvalidArgument, "--groundtruth: only the synthetic world knows the true poses");
  }
  const bool looks_at_masks = !options.masks.draw.empty() || !options.masks.truth.empty();
  if (looks_at_masks && config.source.pacing != Pacing::Lockstep) {
    return make_error(ErrorCode::InvalidArgument, "--draw and --mask-truth take the tracker's time, so they need --lockstep");
  }
  if (std::error_code failed; !options.masks.draw.empty()) {
    std::filesystem::create_directories(options.masks.draw, failed);
    if (failed) {
      return make_error(ErrorCode::Io, fmt::format("{}: {}", options.masks.draw.string(), failed.message()));
    }
  }
  for (const std::filesystem::path& output : options.outputs()) {
    if (Status status = output.empty() ? Status{} : check_writable(output); !status) {
      return status;
    }
  }
  return {};
}

int exit_code_after(const ReplayStats& stats, const SourceErrors& source_errors) {
  if (stats.health.source_failed) {
    return exit_code_of(source_errors.last().code);
  }
  if (stats.health.map_save_errors > 0) {
    return exit_code_of(ErrorCode::Io);  // the log has said why
  }
  return stats.health.frames_tracked > 0 ? kExitOk : kExitNegative;
}

int run_replay(const ReplayOptions& options, const Console& console) {
  Result<Config> config = make_replay_config(options.source);
  if (!config) {
    return report_error(console.err, config.error());
  }
  config->map.mode = options.localization_only ? MapMode::Localization : MapMode::Mapping;
  const bool asks_for_people = options.publish || !options.detections.empty() || config->dynamic.mode != DynamicMode::Off;
  config->detector.enabled = config->detector.enabled && asks_for_people;
  if (const Status status = check_before_run(options, *config); !status) {
    return report_error(console.err, status.error());
  }
  SourceErrors source_errors;
  std::string detections;
  std::optional<EstimateRecorder> recorder;
  AppOptions app_options;
  app_options.publish = options.publish;
  app_options.map_files = MapFiles{options.map_in.string(), false, options.map_out.string()};  // never the robot's own
  app_options.on_estimate = [&recorder](const PoseEstimate& estimate) { recorder->record(estimate); };
  app_options.on_detections = [&detections](const Detections& found) { append_detections(found, detections); };
  app_options.on_source_error = [&source_errors](const Error& error) { source_errors.add(error); };
  std::optional<MaskReport> masks;
  if (!options.masks.draw.empty() || !options.masks.truth.empty()) {
    masks.emplace(options.masks, *config);
    app_options.on_tracked = [&masks](const TrackedView& view) { masks->add(view); };
  }
  const Result<std::unique_ptr<App>> app = App::create(*config, app_options, SystemClock::instance());
  if (!app) {
    return report_error(console.err, app.error());
  }
  const std::uint64_t total_frames = (*app)->source_info().total_frames;
  recorder.emplace(total_frames > 0 ? total_frames : kFramesWhereUnknown);
  Result<ReplayStats> stats = run_to_end(**app, options, console);
  if (!stats) {
    return report_error(console.err, stats.error());
  }
  source_errors.print_rest(console.err);
  stats->residual_variance = recorder->residual_variance();
  const Status written =
      write_outputs(options, *stats, *recorder, **app, console.err)
          .and_then([&] { return options.groundtruth.empty() ? Status{} : write_truth(options.groundtruth, *config, *recorder); })
          .and_then([&] { return options.detections.empty() ? Status{} : write_whole_file(options.detections, detections); });
  if (!written) {
    return report_error(console.err, written.error());
  }
  fmt::print(console.out, "{}", format_replay_summary(*stats));
  if (masks) {
    fmt::print(console.out, "{}", masks->summary());
    if (!masks->status()) {
      return report_error(console.err, masks->status().error());
    }
  }
  return exit_code_after(*stats, source_errors);
}

void add_source_options(CLI::App& command, ReplaySource& source) {
  CLI::Option* sequence =
      command.add_option("--sequence", source.sequence, "Replay this recording, a folder in the TUM RGB-D layout");
  command.add_flag("--synthetic", source.synthetic, "Replay the synthetic world, without any recording")->excludes(sequence);
  command.add_option("--camera", source.camera, "Calibration of the camera (TOML), such as config/cameras/tum_fr1.toml");
  command.add_option("--config", source.config,
                     "The daemon's configuration (TOML); what is given here as an option goes before it");
  command.add_option("--associations", source.associations, "File that pairs colour and depth images, instead of their stamps")
      ->needs(sequence);
  CLI::Option* lockstep =
      command.add_flag("--lockstep", source.lockstep, "As fast as possible, every frame, nothing dropped; repeatable bit by bit");
  command
      .add_flag_callback(
          "--realtime", [&source] { source.lockstep = false; },
          "At the pace of the stamps, as on a robot: frames are dropped where the machine is too slow (the default)")
      ->excludes(lockstep);
  const std::map<std::string, SyntheticMode> modes{{"sitting", SyntheticMode::Sitting}, {"walking", SyntheticMode::Walking}};
  command.add_option("--seed", source.seed, "Synthetic: the world's seed")->excludes(sequence);
  command.add_option("--mode", source.mode, "Synthetic: what people do, sitting or walking")
      ->transform(CLI::CheckedTransformer(modes))
      ->excludes(sequence);
  command.add_option("--people", source.people, "Synthetic: how many people")->check(CLI::Range(0, 20))->excludes(sequence);
  command
      .add_option("--duration", source.duration_s,
                  fmt::format("Synthetic: length [s]; {} where nothing says otherwise", kDefaultSyntheticDuration_s))
      ->check(CLI::PositiveNumber)
      ->excludes(sequence);
  const std::map<std::string, DynamicMode> dynamics{
      {"off", DynamicMode::Off}, {"boxes", DynamicMode::Boxes}, {"full", DynamicMode::Full}};
  command
      .add_option("--dynamic", source.dynamic,
                  "What moves is left out: off (everything is static), boxes (all of detected people's boxes), full (the default)")
      ->transform(CLI::CheckedTransformer(dynamics));
  command.add_flag("--no-noise", source.no_noise, "Synthetic: a sensor without noise")->excludes(sequence);
}

}  // namespace

void add_replay_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = parent.add_subcommand(
      "replay", "Run the daemon's pipeline on a recording or on the synthetic world, and write what it finds");
  add_source_options(*command, options->source);
  command->add_option("--trajectory", options->trajectory,
                      "Write the final trajectory, after all corrections of the map (TUM format)");
  command->add_option("--online-trajectory", options->online_trajectory,
                      "Write the poses as they were published at the time (TUM format)");
  command->add_option("--stats", options->stats, "Write counters and latencies (JSON)");
  command->add_option("--groundtruth", options->groundtruth,
                      "Synthetic: write the true pose of every processed frame (TUM format)");
  command->add_option("--detections", options->detections,
                      "Look for people, and write lines `stamp score x_min y_min x_max y_max` [s, pixels]");
  CLI::Option* draw = command->add_option(
      "--draw", options->masks.draw, "Folder for pictures of frames: movers tinted, features kept (green) and left out (blue)");
  command->add_option("--draw-every", options->masks.draw_every, "Frames from one picture to the next; 15 unless given")
      ->check(CLI::Range(1, 1'000'000))
      ->needs(draw);
  command->add_option("--mask-truth", options->masks.truth, "Folder of true masks, STAMP.png, to compare what was left out with")
      ->check(CLI::ExistingDirectory);
  CLI::Option* map_in = command->add_option("--map-in", options->map_in, "Begin with this saved map");
  CLI::Option* map_out = command->add_option("--map-out", options->map_out, "Save the map at the end");
  command->add_flag("--localization-only", options->localization_only, "Use the map of --map-in without changing it")
      ->needs(map_in)
      ->excludes(map_out);
  command->add_flag("--publish", options->publish, "Publish over LCM, too");
  command->add_flag("--quiet", options->quiet, "No progress");
  command->callback([options, &console, &exit_code] { exit_code = run_replay(*options, console); });
}

}  // namespace posed
