#include "config/config_loader.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "config/config_schema.h"
#include "config/data_file.h"
#include "config/model_name.h"
#include "config/strict_reader.h"
#include "config/text_file.h"

namespace posed {

namespace {

bool is_recording(const SourceConfig& source) {
  constexpr std::string_view kOni = ".oni";
  return source.kind == SourceKind::OpenNi2 && source.openni2.device.ends_with(kOni);
}

bool is_camera(const SourceConfig& source) {
  return source.kind != SourceKind::Replay && source.kind != SourceKind::Synthetic && !is_recording(source);
}

void check_cameras(StrictReader& reader, const SourceConfig& source) {
  const bool without_depth = source.kind == SourceKind::V4l2 || source.kind == SourceKind::Libcamera;
  reader.require(source.kind != SourceKind::V4l2 || !source.v4l2.device.empty(), {"source.kind", "source.v4l2.device"},
                 "needs source.v4l2.device, the node of the colour camera");
  reader.require(!without_depth || !source.depth.node.device.empty(), {"source.kind", "source.depth.device"},
                 "a colour camera alone cannot be tracked in metres: set source.depth.device, the node of a depth camera");
  reader.require(source.faults.empty() || source.kind == SourceKind::Synthetic || source.kind == SourceKind::Replay,
                 {"source.faults", "source.kind"}, "only a recording and the rendered world take faults; a camera has its own");
  reader.require(source.pacing != Pacing::Lockstep || !is_camera(source), {"source.pacing", "source.kind"},
                 "a camera does not wait: \"lockstep\" is for recordings and the rendered world");
}

void check_gpio(StrictReader& reader, const GpioConfig& gpio) {
  const auto differ = [](int a, int b) { return a < 0 || a != b; };
  reader.require(differ(gpio.status_line, gpio.enable_line) && differ(gpio.status_line, gpio.trigger_line) &&
                     differ(gpio.enable_line, gpio.trigger_line),
                 {"gpio.status_line", "gpio.enable_line", "gpio.trigger_line"},
                 "status_line, enable_line and trigger_line must be different lines");
}

/// Rules that tie keys together. The first key of a rule is blamed where the text has it.
void check_rules(StrictReader& reader, const Config& c) {
  reader.require(c.source.kind != SourceKind::Replay || !c.source.replay.sequence.empty(),
                 {"source.kind", "source.replay.sequence"}, "needs source.replay.sequence, the folder of a recording");
  check_cameras(reader, c.source);
  reader.require(
      c.source.synthetic.people == 0 || c.source.synthetic.world == SyntheticWorldKind::Room,
      {"source.synthetic.world", "source.synthetic.people"},
      fmt::format("only the world \"room\" has people: source.synthetic.people ({}) must be 0 here", c.source.synthetic.people));
  reader.require(c.tracker.fast_threshold_minimum <= c.tracker.fast_threshold,
                 {"tracker.fast_threshold_minimum", "tracker.fast_threshold"},
                 fmt::format("tracker.fast_threshold_minimum ({}) must be at most tracker.fast_threshold ({})",
                             c.tracker.fast_threshold_minimum, c.tracker.fast_threshold));
  reader.require(
      c.tracker.min_inliers < c.tracker.features, {"tracker.min_inliers", "tracker.features"},
      fmt::format("tracker.min_inliers ({}) must be less than tracker.features ({})", c.tracker.min_inliers, c.tracker.features));
  reader.require(c.mapper.local_keyframes <= c.mapper.max_keyframes, {"mapper.local_keyframes", "mapper.max_keyframes"},
                 fmt::format("mapper.local_keyframes ({}) must be at most mapper.max_keyframes ({})", c.mapper.local_keyframes,
                             c.mapper.max_keyframes));
  reader.require(c.mapper.recovery_keyframes <= c.mapper.max_keyframes, {"mapper.recovery_keyframes", "mapper.max_keyframes"},
                 fmt::format("mapper.recovery_keyframes ({}) must be at most mapper.max_keyframes ({})",
                             c.mapper.recovery_keyframes, c.mapper.max_keyframes));
  reader.require(c.map.mode != MapMode::Localization || !c.map.file.empty(), {"map.mode", "map.file"},
                 "needs map.file, the map to localize in");
  const int needed = c.pipeline.frame_queue + 2 + (c.detector.enabled ? 3 : 0);
  reader.require(c.pipeline.frame_slots >= needed, {"pipeline.frame_slots", "pipeline.frame_queue"},
                 fmt::format("pipeline.frame_slots ({}) must be at least pipeline.frame_queue ({}) + {}", c.pipeline.frame_slots,
                             c.pipeline.frame_queue, needed - c.pipeline.frame_queue));
}

void check_thread(StrictReader& reader, const std::string& section, const ThreadConfig& thread) {
  const std::string policy = section + ".policy";
  const std::string priority = section + ".priority";
  reader.require(thread.policy != ThreadPolicyName::Fifo || thread.priority >= 1, {priority, policy},
                 fmt::format("policy \"fifo\" needs {} from 1 to 99", priority));
  reader.require(thread.policy != ThreadPolicyName::Deadline || section == "pipeline.detector", {policy},
                 "\"deadline\" is for the detector alone: it would take the processor away from every other thread");
}

/// ORB describes a patch of 31 x 31 pixels, and FAST looks 3 pixels around a corner: nothing fits into a smaller image.
void check_pyramid(StrictReader& reader, const Config& c) {
  constexpr double kSmallestSide = 31 + 2 * 3;
  const double side =
      std::min(c.intrinsics.width, c.intrinsics.height) / std::pow(c.tracker.pyramid_scale, c.tracker.pyramid_levels - 1);
  reader.require(
      side >= kSmallestSide, {"tracker.pyramid_levels", "tracker.pyramid_scale", "camera.calibration"},
      fmt::format("{} levels of scale {} leave {:.0f} pixels of a {}x{} image, needed are {:.0f}", c.tracker.pyramid_levels,
                  c.tracker.pyramid_scale, side, c.intrinsics.width, c.intrinsics.height, kSmallestSide));
}

void resolve_path(const std::filesystem::path& folder, std::string& path) {
  if (!path.empty() && !folder.empty()) {
    path = (folder / path).lexically_normal().string();  // an absolute `path` stays as it is
  }
}

/// Reads the calibration that `key` names, and makes its path whole; `folders` come before the shipped ones.
bool read_calibration(StrictReader& reader, const std::string& key, const std::vector<std::filesystem::path>& folders,
                      std::string& name, CameraIntrinsics& intrinsics) {
  const Result<std::filesystem::path> file = find_file(name, folders, calibration_folders());
  if (!file) {
    reader.require(false, {key}, file.error().message);
    return false;
  }
  const Result<CameraIntrinsics> read = load_camera(*file);
  if (!read) {
    reader.add_foreign(read.error());
    return false;
  }
  name = file->string();
  intrinsics = *read;
  return true;
}

/// Makes their paths ready to open; `folders` come before the shipped models' ones.
void find_models(StrictReader& reader, const std::vector<std::filesystem::path>& folders, DetectorConfig& detector) {
  if (!detector.enabled) {
    return;
  }
  reader.require(!detector.models.empty(), {"detector.models"}, "names no file; set detector.enabled = false to look for nobody");
  for (std::string& model : detector.models) {
    ModelName name = parse_model_name(model);
    if (const Result<std::filesystem::path> file = find_file(name.file, folders, model_folders())) {
      name.file = file->string();
      model = to_string(name);
    } else {
      reader.require(false, {"detector.models"}, fmt::format("{}: {}", model, file.error().message));
    }
  }
}

Result<Config> read_config(const std::string& text, const std::filesystem::path& name,
                           const std::vector<std::filesystem::path>& folders) {
  Config config;
  StrictReader reader(name, config_schema(config));
  reader.read(text);
  check_rules(reader, config);
  check_gpio(reader, config.gpio);
  check_thread(reader, "pipeline.capture", config.pipeline.capture);
  check_thread(reader, "pipeline.tracker", config.pipeline.tracker);
  check_thread(reader, "pipeline.mapper", config.pipeline.mapper);
  check_thread(reader, "pipeline.detector", config.pipeline.detector);
  check_thread(reader, "pipeline.publisher", config.pipeline.publisher);
  resolve_path(name.parent_path(), config.source.replay.sequence);
  resolve_path(name.parent_path(), config.source.replay.associations);
  resolve_path(name.parent_path(), config.map.file);
  if (is_recording(config.source)) {
    resolve_path(name.parent_path(), config.source.openni2.device);
  }
  find_models(reader, folders, config.detector);
  if (read_calibration(reader, "camera.calibration", folders, config.camera.calibration, config.intrinsics)) {
    check_pyramid(reader, config);
  }
  DepthNodeConfig& depth = config.source.depth;
  if (!depth.calibration.empty()) {
    read_calibration(reader, "source.depth.calibration", folders, depth.calibration, depth.intrinsics);
  }
  return reader.status().map([&] { return config; });
}

}  // namespace

Result<Config> load_config(const std::filesystem::path& path) {
  return read_text_file(path).and_then([&](const std::string& text) { return parse_config(text, path); });
}

Result<Config> parse_config(const std::string& text, const std::filesystem::path& name) {
  return read_config(text, name, {name.parent_path()});
}

Result<Config> default_config() {
  return read_config("", "built-in defaults", {});
}

}  // namespace posed
