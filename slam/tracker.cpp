#include "slam/tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "core/clock.h"
#include "slam/drift_model.h"
#include "slam/feature_frame.h"
#include "slam/frame_localizer.h"
#include "slam/keyframe_recovery.h"
#include "slam/landmark_visibility.h"
#include "slam/motion_model.h"
#include "slam/orb_extractor.h"
#include "slam/pose_covariance.h"

namespace posed {

namespace {

constexpr int kMinDepthsToInitialize = 100;  // keypoints with depth that a first keyframe must have
constexpr float kPredictedRadius = 10.0F;    // [pixels on level 0] around last frame's landmarks where the motion model puts them
constexpr float kWideRadius = 30.0F;         // the same when that finds too little
constexpr int kFewMatches = 40;
constexpr KeyframeId kYoungMapKeyframes = 5;  // the only map is not worth finding again where it is lost before it has as many
constexpr int kRecoveriesPerFrame = 2;        // keyframes tried a frame, so that a lost tracker stays in its time
constexpr int kMinRecoveryInliers = 15;
constexpr float kMoverTrust = 0.1F;  // weight of a feature on a mover, where there is too little else
constexpr float kMuchMasked = 0.2F;  // share of the image without which movers are not to blame for a loss
constexpr int kCloseTracked = 100;   // fewer close landmarks tracked and...
constexpr int kCloseUntracked = 70;  // ...more close keypoints unmatched than this asks for a keyframe

TimeNs now_ns() {
  return SystemClock::instance().now_ns();
}

}  // namespace

struct Tracker::Impl {
  Impl(const TrackerConfig& tracker, const MapperConfig& mapper, const DynamicConfig& dynamic, MapMode map_mode,
       const CameraIntrinsics& intrinsics, const Se3& T_map_camera_start);

  PoseEstimate track(const RgbdFrame& rgbd, const MapSnapshot& map, const Detections* newest, KeyframeRecord* candidate);
  void extract(const RgbdFrame& rgbd);
  std::optional<Se3> T_depth_color(const RgbdFrame& rgbd) const;
  void leave_movers_out(const MapSnapshot& map);
  void adopt(const MapSnapshot& map);
  bool can_initialize() const;
  bool is_young() const { return last_keyframe - map_begin < kYoungMapKeyframes; }
  bool wants_map(const MapSnapshot& map, TimeNs elapsed_ns);
  void initialize(const MapSnapshot& map);
  void find_camera(const MapSnapshot& map);
  PoseEstimate describe(const MapSnapshot& map, KeyframeRecord* candidate);
  bool track_by_motion(const MapSnapshot& map);
  bool use_answer(const MapSnapshot& map);
  bool recover(const MapSnapshot& map);
  bool refine_recovered(const MapSnapshot& map);
  bool wants_keyframe(const MapSnapshot& map);
  void fill_keyframe(KeyframeRecord& record, const MapSnapshot& map);
  bool may_ask(const MapSnapshot& map) const;
  void fill_features(KeyframeRecord& record, const MapSnapshot& map) const;
  void remember(const MapSnapshot& map);
  void refer_to_keyframe(const MapSnapshot& map, PoseEstimate& estimate) const;

  TrackerConfig config;
  MapMode mode;
  PinholeCamera camera;
  OrbExtractor extractor;
  std::optional<DynamicMask> mask;
  FrameLocalizer localizer;
  FrameLocalizer::Result spare;  // what to go back to; here to keep its memory
  KeyframeRecovery recovery;
  MotionModel motion;
  Se3 T_map_start;

  // This frame.
  FeatureFrame frame;
  std::uint64_t sequence = 0;
  std::int64_t stamp_utc_ns = 0;  // 0: no frame yet
  bool starts_map = false;
  bool wary = false;  // features of movers were let in
  Se3 T_map_odom;
  Timing timing;

  // From frame to frame.
  TrackingState state = TrackingState::Initializing;
  std::vector<LandmarkId> last_landmarks;  // inliers of the last frame, ascending
  std::vector<std::uint32_t> anchors;      // of this frame's inliers, ascending; here to keep its memory
  KeyframeId last_keyframe = kNoKeyframe;
  int frames_since_keyframe = 0;
  int reference_inliers = 0;  // best seen since the mapper took the last keyframe in
  bool has_map = false;
  bool has_old_map = false;  // besides the present one: the camera may be found there
  std::uint32_t map_id = 0;
  std::uint32_t newest_map_id = 0;
  KeyframeId map_begin = kNoKeyframe;  // last keyframe before the map began
  TimeNs searched_ns = 0;              // time since the camera was lost, but for frames that show too little
  std::uint64_t asked_sequence = 0;    // frame that the mapper was last asked about
  bool asked = false;
  std::uint64_t used_answer = 0;  // its last answer that was tried
  std::size_t next_recovery = 0;  // index into the snapshot's keyframes
};

Tracker::Impl::Impl(const TrackerConfig& tracker, const MapperConfig& mapper, const DynamicConfig& dynamic, MapMode map_mode,
                    const CameraIntrinsics& intrinsics, const Se3& T_map_camera_start)
    : config(tracker),
      mode(map_mode),
      camera(intrinsics),
      extractor(tracker, intrinsics.width, intrinsics.height),
      localizer(camera, tracker, static_cast<std::size_t>(mapper.local_landmarks)),
      recovery(camera, tracker),
      T_map_start(T_map_camera_start),
      frame(camera, feature_capacity(tracker.features)) {
  spare.landmark_of.reserve(feature_capacity(config.features));
  last_landmarks.reserve(feature_capacity(config.features));
  anchors.reserve(feature_capacity(config.features));
  if (dynamic.mode != DynamicMode::Off) {
    mask.emplace(dynamic, camera);
  }
}

/// How the camera moved between a frame's two images, by its last known velocity; nothing where they are of one instant.
std::optional<Se3> Tracker::Impl::T_depth_color(const RgbdFrame& rgbd) const {
  const TimeNs offset_ns = rgbd.depth_offset_ns + from_seconds(camera.intrinsics().depth_delay_s);
  return offset_ns == 0 ? std::nullopt : std::optional(motion.motion_over(-offset_ns));
}

/// Features of what is not known to move; as many as without movers, so that the static rest gets more. Where that does not carry a
/// pose, the tracker is wary: features of movers too, at little weight. They may stand still, after all, and if they do not, the
/// others outvote them.
void Tracker::Impl::extract(const RgbdFrame& rgbd) {
  extractor.extract(rgbd.gray, frame.features(), mask && !wary ? mask->interior() : std::span<const std::uint8_t>());
  frame.place(camera, rgbd.depth_m, T_depth_color(rgbd), [this](const Keypoint& k, float depth_m) {
    return mask && mask->is_mover(k.x, k.y, depth_m) ? (wary ? kMoverTrust : 0.0F) : 1.0F;
  });
  localizer.reset(frame);
}

/// With the pose known, more may turn out to move than was known before; the pose is then sought once more without it.
void Tracker::Impl::leave_movers_out(const MapSnapshot& map) {
  if (!mask) {
    return;
  }
  if (state != TrackingState::Tracking) {
    mask->settle_lost();
    return;
  }
  if (!mask->settle(T_map_odom.inverse() * localizer.solution().T_map_camera) || starts_map || wary) {
    return;
  }
  spare = localizer.result();
  const auto is_mover = [this](std::size_t i) {
    const Keypoint& k = frame.features().keypoints[i];
    return mask->is_mover(k.x, k.y, frame.depth_m()[i]);
  };
  if (localizer.drop_where(is_mover) > 0 &&
      !(localizer.solve(map, frame, spare.solution.T_map_camera) && localizer.solution().inliers >= config.min_inliers)) {
    localizer.restore(spare);
  }
}

/// A map that was there before the first frame, loaded from a file, is searched before a new one is begun.
void Tracker::Impl::adopt(const MapSnapshot& map) {
  has_map = true;
  has_old_map = true;
  last_keyframe = map.newest_keyframe;
  state = TrackingState::Relocalizing;
}

bool Tracker::Impl::can_initialize() const {
  return std::count_if(frame.depth_m().begin(), frame.depth_m().end(), [](float z) { return z > 0; }) >= kMinDepthsToInitialize;
}

/// Whether a new map should be begun: there is none, or the camera was not found again in the time allowed.
bool Tracker::Impl::wants_map(const MapSnapshot& map, TimeNs elapsed_ns) {
  if (mode == MapMode::Localization || state == TrackingState::Tracking || !can_initialize()) {
    return false;  // a covered camera cannot be found, so its time does not count
  }
  if (!has_map) {
    return true;
  }
  if (map.version == 0 || map.newest_keyframe <= map_begin) {
    return false;  // one is being begun
  }
  searched_ns += elapsed_ns;
  return (is_young() && !has_old_map) || to_seconds(searched_ns) > config.new_map_after_s;
}

/// The first keyframe of a map defines it. Later maps begin where the camera was seen last, so that odom goes on.
void Tracker::Impl::initialize(const MapSnapshot& map) {
  newest_map_id = std::max(newest_map_id, map.newest_map_id) + 1;
  map_id = newest_map_id;
  has_old_map = has_old_map || (has_map && !is_young());
  map_begin = last_keyframe;
  has_map = true;
  starts_map = true;
  T_map_odom = Se3();
  localizer.begin_at(frame, motion.last_pose().value_or(T_map_start));
  motion.restart();
  state = TrackingState::Tracking;
}

bool Tracker::Impl::track_by_motion(const MapSnapshot& map) {
  const Se3 predicted = map.T_map_odom * motion.predict(stamp_utc_ns);
  localizer.match(map, frame, last_landmarks, predicted, kPredictedRadius);
  if (localizer.matches() < kFewMatches) {
    localizer.match(map, frame, last_landmarks, predicted, kWideRadius);
  }
  if (localizer.matches() < kFewMatches) {
    localizer.match(map, frame, {}, predicted, kPredictedRadius);  // what was seen last may have been joined with other landmarks
  }
  return localizer.solve(map, frame, predicted) && localizer.refine(map, frame, config.min_inliers);
}

/// Twice: a recovered pose rests on few matches, so the first search may miss much of the local map.
bool Tracker::Impl::refine_recovered(const MapSnapshot& map) {
  if (localizer.refine(map, frame, config.min_inliers) && localizer.refine(map, frame, config.min_inliers)) {
    motion.restart();
    return true;
  }
  return false;
}

/// The mapper has found where an earlier frame was taken: this one cannot be far from there.
bool Tracker::Impl::use_answer(const MapSnapshot& map) {
  const RelocalizationAnswer& answer = map.relocalization;
  if (!answer.found || answer.sequence == used_answer) {
    return false;
  }
  used_answer = answer.sequence;
  next_recovery = 0;  // else by the keyframes of the place found
  localizer.match(map, frame, {}, answer.T_map_camera, kWideRadius);
  return localizer.solve(map, frame, answer.T_map_camera) && refine_recovered(map);
}

bool Tracker::Impl::recover(const MapSnapshot& map) {
  if (use_answer(map)) {
    return true;
  }
  for (int i = 0; i < kRecoveriesPerFrame && !map.keyframes.empty(); ++i) {
    const SnapshotKeyframe& keyframe = map.keyframes[next_recovery++ % map.keyframes.size()];
    const auto recovered = recovery.recover(map, keyframe, frame, kMinRecoveryInliers);
    if (!recovered) {
      continue;
    }
    localizer.begin_at(frame, recovered->T_map_camera);
    if (refine_recovered(map)) {
      return true;
    }
  }
  return false;
}

bool Tracker::Impl::wants_keyframe(const MapSnapshot& map) {
  if (map.newest_keyframe < last_keyframe) {
    return false;  // the mapper has not taken in the last one yet
  }
  reference_inliers = std::max(reference_inliers, localizer.solution().inliers);
  int close_tracked = 0;
  int close_untracked = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame.depth_m()[i] > 0 && frame.depth_m()[i] < config.close_depth_m) {
      ++(localizer.landmark_of()[i] == kUnmatched ? close_untracked : close_tracked);
    }
  }
  return frames_since_keyframe >= config.keyframe_max_interval ||
         localizer.solution().inliers < config.keyframe_inlier_ratio * reference_inliers ||
         (close_tracked < kCloseTracked && close_untracked > kCloseUntracked);
}

void Tracker::Impl::fill_features(KeyframeRecord& record, const MapSnapshot& map) const {
  record.sequence = sequence;
  record.map_id = map_id;
  record.T_map_odom = T_map_odom;
  record.starts_map = starts_map;
  copy_static(frame, localizer.landmark_of(), map, mask ? &*mask : nullptr, record);
}

void Tracker::Impl::fill_keyframe(KeyframeRecord& record, const MapSnapshot& map) {
  fill_features(record, map);
  record.purpose = RecordPurpose::Keyframe;
  record.id = ++last_keyframe;
  record.T_map_camera = localizer.solution().T_map_camera;
  record.covariance = localizer.solution().covariance;
  if (mask) {
    judge_visibility(map, *mask, record.T_map_camera, record);
  }
  frames_since_keyframe = 0;
  reference_inliers = 0;
}

/// One question at a time, and none about a frame that shows too little to be found.
bool Tracker::Impl::may_ask(const MapSnapshot& map) const {
  const bool waiting = asked && (!map.relocalization.answered || map.relocalization.sequence < asked_sequence);
  return has_map && map.version > 0 && state != TrackingState::Initializing && !waiting && can_initialize();
}

/// Keeps what the next frame is predicted from.
void Tracker::Impl::remember(const MapSnapshot& map) {
  motion.observe(T_map_odom.inverse() * localizer.solution().T_map_camera, stamp_utc_ns);
  last_landmarks.clear();
  for (const std::int32_t landmark : localizer.landmark_of()) {
    if (landmark != kUnmatched) {
      last_landmarks.push_back(map.landmarks[static_cast<std::size_t>(landmark)].id);
    }
  }
  std::sort(last_landmarks.begin(), last_landmarks.end());
}

void Tracker::Impl::refer_to_keyframe(const MapSnapshot& map, PoseEstimate& estimate) const {
  if (estimate.keyframe) {
    estimate.reference_keyframe = last_keyframe;
  } else if (!map.keyframes.empty()) {
    estimate.reference_keyframe = map.keyframes.front().id;
    estimate.T_reference_camera = map.keyframes.front().T_map_camera.inverse() * localizer.solution().T_map_camera;
  }
}

/// Tracks, or recovers, or says that the camera is lost.
void Tracker::Impl::find_camera(const MapSnapshot& map) {
  if (map.version == 0 || map.newest_keyframe <= map_begin) {
    state = TrackingState::Initializing;  // the mapper is still busy with the first keyframe
    return;
  }
  if (map.map_id != map_id) {
    map_id = map.map_id;  // joined with another map, or left for the one where the camera was found
    map_begin = kNoKeyframe;
  }
  const bool was_lost = state == TrackingState::Lost || state == TrackingState::Relocalizing;
  if (!was_lost) {
    next_recovery = 0;  // just lost, it is most likely near the newest keyframe
    searched_ns = 0;
  }
  if ((!was_lost && track_by_motion(map)) || recover(map)) {
    state = TrackingState::Tracking;
    return;
  }
  state = was_lost ? TrackingState::Relocalizing : TrackingState::Lost;
}

PoseEstimate Tracker::Impl::track(const RgbdFrame& rgbd, const MapSnapshot& map, const Detections* newest,
                                  KeyframeRecord* candidate) {
  const TimeNs begin_ns = now_ns();
  timing = Timing{};
  // Before the first frame no time has passed: a loaded map is searched for as long as any other.
  const TimeNs elapsed_ns = stamp_utc_ns == 0 ? 0 : std::max<TimeNs>(0, rgbd.stamp_utc_ns - stamp_utc_ns);
  sequence = rgbd.sequence;
  stamp_utc_ns = rgbd.stamp_utc_ns;
  if (mask) {
    mask->begin(rgbd, motion.last_pose() ? motion.predict(stamp_utc_ns) : T_map_start, newest);
  }
  const TimeNs masked_ns = now_ns();
  timing.mask_ns = masked_ns - begin_ns;
  wary = false;
  extract(rgbd);
  timing.extract_ns = now_ns() - masked_ns;
  ++frames_since_keyframe;
  starts_map = false;
  T_map_odom = map.T_map_odom;

  if (!has_map && map.version > 0 && !map.keyframes.empty()) {
    adopt(map);
  }
  if (has_map) {
    const bool was_tracking = state == TrackingState::Tracking;
    find_camera(map);
    if (was_tracking && state == TrackingState::Lost && mask && mask->summary().masked_share > kMuchMasked) {
      wary = true;
      extract(rgbd);
      state = track_by_motion(map) ? TrackingState::Tracking : TrackingState::Lost;
    }
  }
  if (candidate != nullptr && wants_map(map, elapsed_ns)) {
    initialize(map);
  }
  const TimeNs found_ns = now_ns();
  leave_movers_out(map);
  timing.mask_ns += now_ns() - found_ns;
  PoseEstimate estimate = describe(map, candidate);
  estimate.sequence = rgbd.sequence;
  estimate.capture_ns = rgbd.capture_ns;
  estimate.stamp_utc_ns = rgbd.stamp_utc_ns;
  if (candidate != nullptr) {
    candidate->capture_ns = rgbd.capture_ns;
  }
  estimate.track_ns = now_ns() - begin_ns;
  timing.solve_ns = localizer.take_solve_ns();
  timing.match_ns = estimate.track_ns - timing.mask_ns - timing.extract_ns - timing.solve_ns;
  return estimate;
}

/// What is said of this frame, and what is asked of the mapper.
PoseEstimate Tracker::Impl::describe(const MapSnapshot& map, KeyframeRecord* candidate) {
  PoseEstimate estimate;
  estimate.state = state;
  estimate.keypoints = static_cast<std::int32_t>(frame.size());
  estimate.matches = localizer.matches();
  estimate.map_id = map_id;
  estimate.map_version = map.version;
  if (mask) {
    mask->report(estimate);
  }
  if (state == TrackingState::Tracking) {
    estimate.T_map_odom = T_map_odom;
    estimate.T_odom_camera = T_map_odom.inverse() * localizer.solution().T_map_camera;
    estimate.covariance =
        starts_map ? start_covariance() : pose_covariance(localizer.solution(), localizer.landmark_of(), map, anchors);
    estimate.inliers = localizer.solution().inliers;
    estimate.residual_variance = localizer.solution().variance_factor;
    estimate.keyframe = candidate != nullptr && (starts_map || wants_keyframe(map));
    if (estimate.keyframe) {
      fill_keyframe(*candidate, map);
    }
    refer_to_keyframe(map, estimate);
    remember(map);
  } else if (candidate != nullptr && may_ask(map)) {
    estimate.asks_where = true;
    candidate->purpose = RecordPurpose::Relocalization;
    candidate->id = kNoKeyframe;
    fill_features(*candidate, map);
    candidate->landmarks.assign(candidate->features.keypoints.size(), kNoLandmark);
    asked = true;
    asked_sequence = sequence;
  }
  return estimate;
}

Tracker::Tracker(const TrackerConfig& config, const MapperConfig& mapper, const DynamicConfig& dynamic, MapMode mode,
                 const CameraIntrinsics& camera, const Se3& T_map_camera_start)
    : impl_(std::make_unique<Impl>(config, mapper, dynamic, mode, camera, T_map_camera_start)) {}
Tracker::~Tracker() = default;

PoseEstimate Tracker::track(const RgbdFrame& frame, const MapSnapshot& map, const Detections* newest, KeyframeRecord* candidate) {
  return impl_->track(frame, map, newest, candidate);
}

const DynamicMask* Tracker::last_mask() const {
  return impl_->mask ? &*impl_->mask : nullptr;
}

const FeatureFrame& Tracker::last_features() const {
  return impl_->frame;
}

const Tracker::Timing& Tracker::last_timing() const {
  return impl_->timing;
}

}  // namespace posed
