#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "core/clock.h"
#include "drivers/rgbd_source.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/frame_sink.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/progress.h"
#include "tools/posectl/recorder.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/source_errors.h"

namespace posed {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kWaitPeriod_ns = 50 * kNsPerMs;
constexpr TimeNs kSilenceAllowed_ns = kNsPerSecond;  // past the duration asked for, where frames have ceased to come
constexpr std::uint64_t kMegabyte = 1'000'000;
constexpr int kMaxEncoders = 16;

struct RecordOptions {
  fs::path config;
  fs::path folder;
  fs::path lcm_log;
  std::uint64_t frames = 0;
  double duration_s = 0;
  bool jpeg = false;
  int jpeg_quality = EncodingOptions{}.jpeg_quality;
  std::uint64_t min_free_bytes = 1000 * kMegabyte;
  int encoders = std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4);
  bool quiet = false;
};

/// So many frames that they take some 128 MiB, within what makes sense.
std::size_t queue_of(const SourceInfo& info) {
  constexpr std::size_t kBytes = std::size_t{128} << 20;
  constexpr std::size_t kBytesPerPixel = 3 + 1 + 4;
  const std::size_t pixels = static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height);
  return std::clamp<std::size_t>(kBytes / (pixels * kBytesPerPixel), 8, 64);
}

/// An error where less is free than is to be left. A system that does not tell is taken to have enough.
Status check_free_space(const RecordOptions& options) {
  for (const fs::path& path : {options.folder, options.lcm_log.parent_path()}) {
    std::error_code error;
    const fs::space_info space = fs::space(path.empty() ? "." : path, error);
    if (!error && space.available < options.min_free_bytes) {
      return make_error(ErrorCode::Io, fmt::format("{} has {} MB free, and {} MB are to be left (--min-free)", path.string(),
                                                   space.available / kMegabyte, options.min_free_bytes / kMegabyte));
    }
  }
  return {};
}

struct Session {
  RecordOptions options;
  Config config;
  SourceInfo info;
  SourceErrors errors;
  std::unique_ptr<Recorder> recorder;
};

Result<std::vector<std::unique_ptr<FrameSink>>> make_sinks(const RecordOptions& options, const Config& config,
                                                           const EncodingOptions& encoding, const std::string& description) {
  std::vector<std::unique_ptr<FrameSink>> sinks;
  Result<std::unique_ptr<FrameSink>> tum =
      make_tum_sink(options.folder, encoding, format_camera(config.intrinsics, "The camera of this recording: " + description));
  if (!tum) {
    return tl::unexpected(std::move(tum).error());
  }
  sinks.push_back(*std::move(tum));
  if (!options.lcm_log.empty()) {
    Result<std::unique_ptr<FrameSink>> log =
        make_lcm_log_sink(options.lcm_log, config.publisher.channel_prefix + "FRAME", config.intrinsics);
    if (!log) {
      return tl::unexpected(std::move(log).error());
    }
    sinks.push_back(*std::move(log));
  }
  return sinks;
}

/// Everything up to the first frame.
Status prepare(Session& session) {
  const RecordOptions& options = session.options;
  std::error_code ignored;
  if (!options.config.empty() && !fs::exists(options.config, ignored)) {
    return make_error(ErrorCode::NotFound, fmt::format("{} does not exist", options.config.string()));
  }
  Result<Config> config = options.config.empty() ? default_config() : load_config(options.config);
  if (!config) {
    return tl::unexpected(std::move(config).error());
  }
  session.config = *std::move(config);
  const Clock& clock = SystemClock::instance();
  Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(session.config.source, session.config.intrinsics, clock);
  if (!source) {
    return tl::unexpected(std::move(source).error());
  }
  session.info = (*source)->info();
  RecorderOptions recorder;
  recorder.encoding = {.depth_units_per_metre = session.config.intrinsics.depth_units_per_metre,
                       .color_format = options.jpeg ? ColorFormat::Jpeg : ColorFormat::Png,
                       .jpeg_quality = options.jpeg_quality};
  recorder.encoders = options.encoders;
  recorder.queue = queue_of(session.info);
  recorder.max_frames = options.frames;
  recorder.max_duration_ns = from_seconds(options.duration_s);
  Result<std::vector<std::unique_ptr<FrameSink>>> sinks =
      make_sinks(options, session.config, recorder.encoding, session.info.description);
  if (!sinks) {
    return tl::unexpected(std::move(sinks).error());
  }
  if (Status space = check_free_space(options); !space) {
    return space;
  }
  session.recorder = std::make_unique<Recorder>(*std::move(source), *std::move(sinks), recorder, session.errors, clock);
  return {};
}

/// A camera that has fallen silent would never reach the duration by the stamps of its frames.
bool is_time_over(const Session& session, const RecorderReport& report, TimeNs start_ns, TimeNs now_ns) {
  const TimeNs begin_ns = report.first_frame_ns != 0 ? report.first_frame_ns : start_ns;
  return session.options.duration_s > 0 && session.config.source.pacing == Pacing::Realtime &&
         now_ns - begin_ns > from_seconds(session.options.duration_s) + kSilenceAllowed_ns;
}

std::uint64_t frames_expected(const Session& session) {
  std::uint64_t frames = session.options.frames;
  if (frames == 0 && session.options.duration_s > 0) {
    frames = static_cast<std::uint64_t>(session.options.duration_s * session.info.rate_hz);
  }
  const std::uint64_t total = session.info.total_frames;
  return frames == 0 || (total != 0 && total < frames) ? total : frames;
}

std::string note_of(const RecorderReport& report) {
  return report.dropped > 0 ? fmt::format("{} dropped", report.dropped) : "";
}

/// Runs until everything is written; the error says why it ended before it was to.
Status run(Session& session, const Console& console) {
  const Clock& clock = SystemClock::instance();
  const InterruptGuard interrupt;
  const TimeNs start_ns = clock.now_ns();
  ProgressReporter progress(console.err, progress_style(console.err_is_terminal, session.options.quiet), "record",
                            frames_expected(session), start_ns);
  Status ended;
  session.recorder->start();
  while (!session.recorder->wait_finished(kWaitPeriod_ns)) {
    const RecorderReport report = session.recorder->report();
    const TimeNs now_ns = clock.now_ns();
    session.errors.print_new(console.err);
    progress.update(report.committed, now_ns, note_of(report));
    ended = ended ? check_free_space(session.options) : ended;
    if (!ended || interrupt.requested() || is_time_over(session, report, start_ns, now_ns)) {
      session.recorder->request_stop();
    }
  }
  const RecorderReport report = session.recorder->report();
  progress.finish(report.committed, clock.now_ns(), note_of(report));
  session.errors.print_rest(console.err);
  if (!session.recorder->status()) {
    return session.recorder->status();
  }
  return !ended ? ended : report.source_failed ? Status(tl::unexpected(session.errors.last())) : Status();
}

std::string quoted_for_shell(const fs::path& path) {
  std::string quoted = "'";
  for (const char c : path.string()) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + "'";
}

void print_summary(const Session& session, const Console& console) {
  const RecorderReport report = session.recorder->report();
  const fs::path& folder = session.options.folder;
  fmt::print(console.out, "{}: {} frames of {}x{} written, {} dropped, {} missed by the source, {} bad\n", folder.string(),
             report.committed, session.info.width, session.info.height, report.dropped, report.missed, report.skipped);
  if (report.captured > report.committed) {
    fmt::print(console.out, "{} frames were captured and could not be written\n", report.captured - report.committed);
  }
  if (report.committed > 0) {
    fmt::print(console.out, "posectl replay --sequence {} --camera {}\n", quoted_for_shell(folder),
               quoted_for_shell(folder / "camera.toml"));
  }
}

int run_record(const RecordOptions& options, const Console& console) {
  Session session;
  session.options = options;
  if (const Status prepared = prepare(session); !prepared) {
    return report_error(console.err, prepared.error());
  }
  const Status ended = run(session, console);
  print_summary(session, console);
  if (!ended) {
    return report_error(console.err, ended.error());
  }
  const RecorderReport report = session.recorder->report();
  if (report.dropped > 0) {
    fmt::print(console.err,
               "posectl: {} frames were dropped, because encoding or the disk was too slow; try --jpeg or --encoders\n",
               report.dropped);
  }
  return report.dropped > 0 || report.committed == 0 ? kExitNegative : kExitOk;
}

}  // namespace

void add_record_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = parent.add_subcommand("record", "Write what the camera sees as a recording in the TUM RGB-D layout");
  command->add_option("folder,-o,--out", options->folder, "Folder to write to; it is made, and must not hold a recording")
      ->required();
  command->add_option("--config", options->config, "The daemon's configuration (TOML), whose [source] is recorded");
  command->add_option("--duration", options->duration_s, "Length [s]; until SIGINT or SIGTERM unless given")
      ->check(CLI::PositiveNumber);
  command->add_option("--frames", options->frames, "How many frames at most")->check(CLI::PositiveNumber);
  CLI::Option* jpeg = command->add_flag("--jpeg", options->jpeg, "Colour as JPEG: smaller and faster, and not exact");
  command->add_option("--jpeg-quality", options->jpeg_quality, "1 to 100")
      ->check(CLI::Range(1, 100))
      ->capture_default_str()
      ->needs(jpeg);
  command->add_option("--lcm-log", options->lcm_log,
                      "Write the frames as an LCM log, too: posed.rgbd_frame_t on channel <prefix>FRAME");
  command
      ->add_option("--min-free", options->min_free_bytes, "Stop before less of the disk is free, such as 500MB; 1GB unless given")
      ->transform(CLI::AsSizeValue(true));
  command->add_option("--encoders", options->encoders, "Threads that encode images; half of the processors unless given")
      ->check(CLI::Range(1, kMaxEncoders));
  command->add_flag("--no-progress,--quiet", options->quiet, "No progress");
  command->callback([options, &console, &exit_code] { exit_code = run_record(*options, console); });
}

}  // namespace posed
