#include "config/config_schema.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "config/source_schema.h"

namespace posed {

namespace {

bool is_file_name(std::string_view text) {
  return !text.empty() && is_path(text);
}

bool is_lcm_url(std::string_view text) {
  const std::size_t colon = text.find("://");
  const auto is_visible = [](char c) { return c > ' ' && c < 0x7F; };
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return colon != std::string_view::npos && colon > 0 && std::all_of(text.begin(), text.end(), is_visible) &&
         std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(colon), is_letter);
}

/// LCM allows 63 characters in a channel's name; the longest of ours after the prefix stays below 32.
bool is_channel_prefix(std::string_view text) {
  return text.size() <= 31 && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
         });
}

void add_camera(SchemaBuilder& schema, CameraConfig& c) {
  schema.section("camera", "The camera and where it sits on the robot.")
      .key("calibration", TextField{&c.calibration, {"the name of a file", is_file_name}}, "",
           "Camera calibration file. A relative name is looked for beside this file, then in the folders of $POSED_CAMERA_PATH, "
           "then "
           "among the shipped calibrations.")
      .key("T_base_camera", PoseField{&c.T_base_camera}, "m",
           "Pose of the camera (x right, y down, z forward) in the robot's base frame: it maps camera coordinates to base "
           "coordinates.")
      .key("T_map_start", PoseField{&c.T_map_start}, "m",
           "Pose of the base in the map at the start, so that the map can be level or begin at a surveyed point.");
}

void add_tracker(SchemaBuilder& schema, TrackerConfig& c) {
  schema.section("tracker", "Pose of every frame against the local map.")
      .key("features", integer(c.features, 100, 5000), "keypoints", "ORB keypoints extracted from a frame.")
      .key("pyramid_levels", integer(c.pyramid_levels, 1, 12), "", "Levels of the image pyramid.")
      .key("pyramid_scale", real(c.pyramid_scale, 1.05, 2.0), "", "Ratio of the image sizes of neighbouring levels.")
      .key("fast_threshold", integer(c.fast_threshold, 1, 200), "grey levels", "Contrast that the FAST corner test asks for first.")
      .key("fast_threshold_minimum", integer(c.fast_threshold_minimum, 1, 200), "grey levels",
           "Contrast asked for in those parts of an image that have no corner at `fast_threshold`. At most `fast_threshold`.")
      .key("close_depth_m", real(c.close_depth_m, 0.1, 20.0), "m",
           "Keypoints up to this depth become landmarks with the keyframe that sees them; beyond, depth is too noisy to trust "
           "alone.")
      .key("min_inliers", integer(c.min_inliers, 6, 500), "landmarks",
           "A pose that fewer landmarks agree with is not trusted and the state becomes lost. Less than `features`.")
      .key("keyframe_max_interval", integer(c.keyframe_max_interval, 1, 1000), "frames", "A keyframe is made at least this often.")
      .key("keyframe_inlier_ratio", real(c.keyframe_inlier_ratio, 0.1, 1.0), "",
           "A keyframe is made when less than this share of the reference keyframe's landmarks is seen.")
      .key("new_map_after_s", real(c.new_map_after_s, 0.1, 1e6), "s",
           "Lost for so long, the tracker begins a new map; it is joined with the old one when they meet.");
}

void add_mapper(SchemaBuilder& schema, MapperConfig& c) {
  schema.section("mapper", "The map of keyframes and landmarks.")
      .key("max_keyframes", integer(c.max_keyframes, 2, 10000), "keyframes",
           "Keyframes kept, about 150 kB each with their landmarks; of more, those go that tell least.")
      .key("max_landmarks", integer(c.max_landmarks, 1000, 5'000'000), "landmarks",
           "Landmarks kept; of more, those go that were seen least.")
      .key("local_landmarks", integer(c.local_landmarks, 100, 50000), "landmarks",
           "Most landmarks of the local map that the tracker matches against.")
      .key("local_keyframes", integer(c.local_keyframes, 1, 1000), "keyframes",
           "Keyframes whose landmarks make the local map. At most `max_keyframes`.")
      .key("recovery_keyframes", integer(c.recovery_keyframes, 1, 1000), "keyframes",
           "Keyframes of the local map that a lost tracker matches against at once. At most `max_keyframes`.")
      .key("bundle_keyframes", integer(c.bundle_keyframes, 0, 200), "keyframes",
           "Keyframes that a local bundle adjustment moves. 0: none is made.")
      .key("bundle_iterations", integer(c.bundle_iterations, 1, 50), "iterations",
           "Most iterations of a local bundle adjustment, in each of its two rounds.")
      .key("bundle_budget_s", real(c.bundle_budget_s, 0.001, 10.0), "s",
           "A local bundle adjustment is given up after this time, or when a keyframe waits. It keeps what it has reached. Without "
           "effect in lockstep.")
      .key("drift_factor", real(c.drift_factor, 0.1, 100.0), "",
           "For the covariance of poses: how many times the covariance of its own measurement a keyframe adds to the drift that "
           "poses "
           "after it inherit. Above 1, because neighbouring frames share errors.")
      .key("loop_closing", BoolField{&c.loop_closing}, "", "Look for places that were seen before, and correct the map by them.")
      .key("loop_max_drift", real(c.loop_max_drift, 0.001, 1.0), "",
           "Largest drift to be believed, as a share of the shortest path in the map between the two views: a closure that asks "
           "for more "
           "is taken for a place that looks alike, and refused.");
}

void add_map(SchemaBuilder& schema, MapConfig& c) {
  schema.section("map", "The map's file: loaded at start, saved at shutdown, periodically, and on SIGUSR1 or a message.")
      .key("file", TextField{&c.file, {"the path of a file, or \"\"", is_path}}, "",
           "A relative path starts at this file's folder. Where it does not exist yet a new map begins; one that is damaged or was "
           "made "
           "with another camera is refused and never overwritten. Empty: maps are neither loaded nor saved.")
      .key("save_period_s", real(c.save_period_s, 0.0, 1e6), "s",
           "Time between two saves while there is something new; 0: the map is saved at shutdown and on request alone. In "
           "`lockstep` there "
           "are none either.")
      .live()
      .key("mode", choice(c.mode, {{"mapping", MapMode::Mapping}, {"localization", MapMode::Localization}}), "",
           "`mapping` extends the map; `localization` uses the map of `file`, and neither changes nor saves it.");
}

void add_detector(SchemaBuilder& schema, DetectorConfig& c) {
  constexpr std::size_t kMaxModels = 8;
  schema.section("detector", "The detector of people, which keeps to a time budget.")
      .key("enabled", BoolField{&c.enabled}, "", "Look for people.")
      .key(
          "models", TextListField{&c.models, {"the name of a file", is_file_name}, kMaxModels}, "",
          "Networks, from cheap to costly: for each frame the largest whose 95 % quantile of the time fits `budget_s`. A relative "
          "name is looked for beside this file, then in the folders of $POSED_MODEL_PATH, then among the shipped models. "
          "`@WIDTHxHEIGHT` after it is the size of the images it is to look at [pixels], if not that of the file: the same network "
          "for less, or more, time. With several sizes, `@384x288+320x256`, it looks at each frame that often, and boxes and "
          "confidences are joined.")
      .key("budget_s", real(c.budget_s, 0.001, 10.0), "s",
           "A frame that takes longer is given up, and counted; of several sizes, what those that were in time show is kept. "
           "Without effect in `lockstep`.")
      .key("lockstep_model", integer(c.lockstep_model, 0, static_cast<int>(kMaxModels) - 1), "",
           "Which of `models`, counted from 0, looks in `lockstep`, where no clock may decide. The last one where there are fewer.")
      .key("score", real(c.score, 0.01, 0.99), "", "Boxes of less confidence are not reported.")
      .key("memory_s", real(c.memory_s, 0.0, 60.0), "s",
           "A box that continues somebody who was surely seen before is more likely right, so its confidence rises, by less the "
           "longer ago that was, by half as much after about 0.7 of this time, and its sides become a mean of the network's and of "
           "where they should be. 0: each image is judged by itself.")
      .key("iou", real(c.iou, 0.05, 0.95), "",
           "Of two boxes that overlap by more (intersection over union), the less confident one goes.")
      .key("engine", choice(c.engine, {{"posed", DetectorEngine::Posed}, {"opencv", DetectorEngine::OpenCv}}), "",
           "What runs the networks: `posed` its own files (`.posednet`) and ONNX files of the same kind, within the budget; "
           "`opencv` "
           "other ONNX files, by OpenCV's DNN module, which cannot be stopped when the budget is spent.")
      .key("head",
           choice(c.head, {{"anchors", DetectorHead::Anchors}, {"boxes", DetectorHead::Boxes}, {"yolox", DetectorHead::Yolox}}), "",
           "What the networks put out: `anchors` as the shipped ones; `boxes` one table of decoded boxes, as Ultralytics exports "
           "YOLOv5; `yolox` as Megvii exports YOLOX.")
      .key("person_class", integer(c.person_class, 0, 100'000), "", "Which of the networks' classes is a person.");
}

void add_dynamic(SchemaBuilder& schema, DynamicConfig& c) {
  schema.section("dynamic", "What moves is kept out of the geometry.")
      .key("mode", choice(c.mode, {{"off", DynamicMode::Off}, {"boxes", DynamicMode::Boxes}, {"full", DynamicMode::Full}}), "",
           "`off` takes everything for the static world; `boxes` leaves whole boxes of detected people out; `full` cuts people out "
           "by depth, carries them from frame to frame, and finds by depth alone what moves without being a person.")
      .key("max_detection_age_s", real(c.max_detection_age_s, 0.0, 10.0), "s", "Older detections are not used.")
      .key("memory_s", real(c.memory_s, 0.1, 60.0), "s",
           "What moved, and a person, is left out for so long after the last sign of it.")
      .key("lockstep_lag", integer(c.lockstep_lag, 0, 30), "frames",
           "By how many frames detections come late in `lockstep`, where no clock may decide.");
}

void add_publisher(SchemaBuilder& schema, PublisherConfig& c) {
  schema.section("publisher", "What is published over LCM.")
      .key("url", TextField{&c.url, {"an LCM address such as \"udpm://239.255.76.67:7667?ttl=0\"", is_lcm_url}}, "",
           "LCM's address. `ttl=0` keeps messages on this computer, `ttl=1` lets them onto the local network.")
      .key("channel_prefix", TextField{&c.channel_prefix, {"at most 31 letters, digits and underscores", is_channel_prefix}}, "",
           "What the names of all channels begin with.")
      .key("status_period_s", real(c.status_period_s, 0.1, 60.0), "s", "Time between two status messages.")
      .live()
      .key("retry_period_s", real(c.retry_period_s, 0.1, 3600.0), "s",
           "Time between two attempts to start LCM, where it cannot start.")
      .key("bot_core_pose", BoolField{&c.bot_core_pose}, "",
           "Also publish the pose of the base as `bot_core.pose_t`, on the channel BOT_POSE after the prefix.");
}

void add_thread(SchemaBuilder& schema, const std::string& thread, std::string_view description, ThreadConfig& c) {
  constexpr int kMaxCpus = 1024;  // glibc's CPU_SETSIZE
  schema.section("pipeline." + thread, description)
      .key("policy",
           choice(
               c.policy,
               {{"normal", ThreadPolicyName::Normal}, {"fifo", ThreadPolicyName::Fifo}, {"deadline", ThreadPolicyName::Deadline}}),
           "",
           "Scheduling: `normal`; `fifo` for SCHED_FIFO, which needs the permission (CAP_SYS_NICE or an rtprio limit); `deadline`, "
           "for the "
           "detector alone, for SCHED_DEADLINE, half of one processor in slices of `detector.budget_s`, which needs CAP_SYS_NICE "
           "and "
           "no `cpus`. Where it is refused the thread runs as `normal`, with a warning.")
      .key("priority", integer(c.priority, 0, 99), "", "For `fifo`, 1 (low) to 99; `normal` ignores it.")
      .key("cpus", IntegerListField{&c.cpus, 0, kMaxCpus - 1, kMaxCpus}, "", "Processors that the thread may run on; empty: all.");
}

void add_pipeline(SchemaBuilder& schema, PipelineConfig& c) {
  schema.section("pipeline", "Buffers between the threads. All are allocated at start.")
      .key("frame_slots", integer(c.frame_slots, 3, 256), "frames",
           "Frames in memory. At least `frame_queue` + 2, since one is being filled and one tracked, and 3 more for the detector.")
      .key("frame_queue", integer(c.frame_queue, 1, 64), "frames",
           "Frames that wait for the tracker; when full the oldest is dropped.")
      .key("keyframe_queue", integer(c.keyframe_queue, 1, 64), "keyframes",
           "Keyframes that wait for the mapper; while it is full the tracker makes none.")
      .key("publish_queue", integer(c.publish_queue, 1, 4096), "poses",
           "Poses that wait for the publisher; when full the oldest is dropped.")
      .key("lock_memory", BoolField{&c.lock_memory}, "",
           "Keep all memory in RAM, so that no page fault delays a pose. Needs an infinite limit on locked memory, which the "
           "service "
           "has; where it is refused the daemon runs on without, with a warning.");
  add_thread(schema, "capture", "The thread that takes frames from the source.", c.capture);
  add_thread(schema, "tracker", "The thread that computes poses.", c.tracker);
  add_thread(schema, "mapper", "The thread that keeps the map.", c.mapper);
  add_thread(schema, "detector", "The thread that finds people.", c.detector);
  add_thread(schema, "publisher", "The thread that sends messages.", c.publisher);
}

}  // namespace

Schema config_schema(Config& config) {
  SchemaBuilder schema;
  add_source(schema, config.source);
  add_camera(schema, config.camera);
  add_tracker(schema, config.tracker);
  add_mapper(schema, config.mapper);
  add_map(schema, config.map);
  add_detector(schema, config.detector);
  add_dynamic(schema, config.dynamic);
  add_publisher(schema, config.publisher);
  add_gpio(schema, config.gpio);
  add_pipeline(schema, config.pipeline);
  schema.section("logging", "Messages for people, on standard error.")
      .key("level", choice(config.logging.level, {"debug", "info", "warning", "error", "off"}), "",
           "Least severe messages that are shown.")
      .live();
  return std::move(schema).build();
}

Schema camera_schema(CameraIntrinsics& k) {
  constexpr int kMaxSide = 8192;
  SchemaBuilder schema;
  schema.section("camera", "A pinhole camera with radial-tangential distortion; depth is registered to colour.")
      .key("width", integer(k.width, 32, kMaxSide), "pixels", "Image width.")
      .required()
      .key("height", integer(k.height, 32, kMaxSide), "pixels", "Image height.")
      .required()
      .key("fx", real(k.fx, 10.0, 1e5), "pixels", "Horizontal focal length.")
      .required()
      .key("fy", real(k.fy, 10.0, 1e5), "pixels", "Vertical focal length.")
      .required()
      .key("cx", real(k.cx, 0.0, kMaxSide), "pixels",
           "Principal point's column, inside the image; the centre of the first pixel is 0.")
      .required()
      .key("cy", real(k.cy, 0.0, kMaxSide), "pixels", "Principal point's row, inside the image.")
      .required()
      .key("distortion", RealListField{{&k.k1, &k.k2, &k.p1, &k.p2, &k.k3}, -10.0, 10.0}, "",
           "Distortion k1, k2, p1, p2, k3 of the Brown-Conrady model, in OpenCV's order. All 0, or left out: none.")
      .key("depth_units_per_metre", real(k.depth_units_per_metre, 1.0, 1e6), "1/m",
           "A raw 16-bit depth divided by this is in metres.")
      .required()
      .key("baseline_fx", real(k.baseline_fx, 0.1, 1e4), "pixel m",
           "Baseline times `fx` of the virtual stereo camera, whose right image sees a point at depth z at column u - baseline_fx "
           "/ z. It weighs "
           "depth against pixels in the pose: the depth sensor's own baseline is the natural choice.")
      .required()
      .key("depth_delay_s", real(k.depth_delay_s, -0.2, 0.2), "s",
           "How much later than the colour image of the same stamp a depth image was taken; negative: earlier. What the two "
           "stamps of a frame differ by is known without it. The right value is the one with the least `residual_variance` "
           "(`posectl replay --stats`) of a recording with quick motion.");
  return std::move(schema).build();
}

const SchemaKey* find_key(const Schema& schema, std::string_view name) {
  for (const SchemaSection& section : schema) {
    for (const SchemaKey& key : section.keys) {
      if (key.name == name) {
        return &key;
      }
    }
  }
  return nullptr;
}

}  // namespace posed
