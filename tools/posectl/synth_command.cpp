#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "core/clock.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/progress.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/synth_recording.h"

namespace posed {
namespace {

constexpr double kDefaultDuration_s = 10.0;

struct SynthOptions {
  SynthRequest request;
  std::filesystem::path camera;
  std::string size = "640x480";
  std::optional<std::uint64_t> frames;
  double duration_s = kDefaultDuration_s;
  bool no_noise = false;
  bool quiet = false;
};

Result<CameraIntrinsics> camera_of_size(std::string_view size) {
  int width = 0;
  int height = 0;
  const char* const end = size.data() + size.size();
  const auto [after_width, width_error] = std::from_chars(size.data(), end, width);
  if (width_error == std::errc{} && after_width != end && *after_width == 'x') {
    const auto [after_height, height_error] = std::from_chars(after_width + 1, end, height);
    if (height_error == std::errc{} && after_height == end && width >= 64 && height >= 48 && width <= 4096 && height <= 4096) {
      return primesense_camera(width, height);
    }
  }
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("--size {}: not WIDTHxHEIGHT from 64x48 to 4096x4096, as in 640x480", size));
}

Result<SynthRequest> make_request(const SynthOptions& options) {
  const Result<CameraIntrinsics> camera = options.camera.empty() ? camera_of_size(options.size) : load_camera(options.camera);
  if (!camera) {
    return tl::unexpected(camera.error());
  }
  SynthRequest request = options.request;
  request.camera = *camera;
  request.world.sensor_noise = !options.no_noise;
  request.frames = options.frames.value_or(static_cast<std::uint64_t>(std::llround(options.duration_s * request.world.rate_hz)));
  return request;
}

int run_synth(const SynthOptions& options, const Console& console) {
  const Result<SynthRequest> request = make_request(options);
  if (!request) {
    return report_error(console.err, request.error());
  }
  if (const Status status = prepare_recording_folder(*request); !status) {
    return report_error(console.err, status.error());
  }
  const Clock& clock = SystemClock::instance();
  const InterruptGuard interrupt;
  ProgressReporter progress(console.err, progress_style(console.err_is_terminal, options.quiet), "synth", request->frames,
                            clock.now_ns());
  const Result<std::uint64_t> written = write_synthetic_recording(*request, [&](std::uint64_t done) {
    progress.update(done, clock.now_ns());
    return !interrupt.requested();
  });
  if (!written) {
    return report_error(console.err, written.error());
  }
  progress.finish(*written, clock.now_ns());
  fmt::print(console.out, "{}: {} frames of {}x{}, with groundtruth.txt, masks/ and camera.toml\n", request->folder.string(),
             *written, request->camera.width, request->camera.height);
  return kExitOk;
}

}  // namespace

void add_synth_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<SynthOptions>();
  SyntheticConfig& world = options->request.world;
  CLI::App* command = parent.add_subcommand(
      "synth", "Write the synthetic world as a recording in the TUM RGB-D layout, with ground truth and masks");
  command->add_option("--out", options->request.folder, "Folder to write to; it is made")->required();
  const std::map<std::string, SyntheticWorldKind> worlds{{"room", SyntheticWorldKind::Room},
                                                         {"corridor", SyntheticWorldKind::Corridor},
                                                         {"office", SyntheticWorldKind::Office},
                                                         {"twin_rooms", SyntheticWorldKind::TwinRooms}};
  command->add_option("--world", world.world, "room, corridor, office or twin_rooms; room unless given. Only the room has people")
      ->transform(CLI::CheckedTransformer(worlds));
  command->add_option("--seed", world.seed, "The world's seed")->capture_default_str();
  const std::map<std::string, SyntheticMode> modes{{"sitting", SyntheticMode::Sitting}, {"walking", SyntheticMode::Walking}};
  command->add_option("--mode", world.mode, "What people do, sitting or walking; walking unless given")
      ->transform(CLI::CheckedTransformer(modes));
  command->add_option("--people", world.people, "How many people")->check(CLI::Range(0, 20))->capture_default_str();
  CLI::Option* frames = command->add_option("--frames", options->frames, "How many frames")->check(CLI::PositiveNumber);
  command->add_option("--duration", options->duration_s, "Length [s] at 30 frames a second")
      ->check(CLI::PositiveNumber)
      ->excludes(frames)
      ->capture_default_str();
  CLI::Option* size = command->add_option("--size", options->size, "WIDTHxHEIGHT of the images [pixels]")->capture_default_str();
  command->add_option("--camera", options->camera, "Calibration of the camera (TOML) instead of --size")->excludes(size);
  command->add_flag("--no-noise", options->no_noise, "A sensor without noise");
  command->add_flag("--force", options->request.replace, "Replace a recording that is in the folder");
  command->add_flag("--quiet", options->quiet, "No progress");
  command->callback([options, &console, &exit_code] { exit_code = run_synth(*options, console); });
}

}  // namespace posed
