#include "slam/tracker.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_recovery.h"
#include "slam/measurement_noise.h"
#include "slam/motion_model.h"
#include "slam/orb_extractor.h"
#include "slam/pose_solver.h"
#include "slam/projection_matcher.h"

namespace posed {

namespace {

constexpr int kMinDepthsToInitialize = 100;  // keypoints with depth that a first keyframe must have
constexpr float kPredictedRadius = 10.0F;    // [pixels on level 0] around last frame's landmarks where the motion model puts them
constexpr float kWideRadius = 30.0F;         // the same when that finds too little
constexpr int kFewMatches = 40;
constexpr float kLocalMapRadius = 5.0F;       // around the local map's landmarks once the pose is nearly known
constexpr KeyframeId kYoungMapKeyframes = 5;  // a map that is lost before it has as many is not worth finding again
constexpr int kRecoveriesPerFrame = 2;        // keyframes tried a frame, so that a lost tracker stays in its time
constexpr int kMinRecoveryInliers = 15;
constexpr int kCloseTracked = 100;   // fewer close landmarks tracked and...
constexpr int kCloseUntracked = 70;  // ...more close keypoints unmatched than this asks for a keyframe

TimeNs now_ns() {
  return SystemClock::instance().now_ns();
}

}  // namespace

struct Tracker::Impl {
  Impl(const TrackerConfig& tracker, const MapperConfig& mapper, const CameraIntrinsics& intrinsics, const Se3& T_map_camera_start);

  PoseEstimate track(const RgbdFrame& rgbd, const MapSnapshot& map, KeyframeRecord* candidate);
  void initialize(const KeyframeRecord* candidate);
  void find_camera(const MapSnapshot& map);
  bool track_by_motion(const MapSnapshot& map);
  bool recover(const MapSnapshot& map);
  bool refine_in_local_map(const MapSnapshot& map);
  void match_last_frame(const MapSnapshot& map, const Se3& T_map_camera, float radius);
  void match_local_map(const MapSnapshot& map, const Se3& T_map_camera);
  PoseSolution solve(const MapSnapshot& map, const Se3& initial);
  bool wants_keyframe(const MapSnapshot& map);
  void fill_keyframe(KeyframeRecord& record, const MapSnapshot& map);
  void remember(const MapSnapshot& map);
  void refer_to_keyframe(const MapSnapshot& map, PoseEstimate& estimate) const;

  TrackerConfig config;
  PinholeCamera camera;
  MeasurementNoise noise;
  OrbExtractor extractor;
  ProjectionMatcher matcher;
  KeyframeRecovery recovery;
  MotionModel motion;
  Se3 T_map_start;

  // This frame.
  FeatureFrame frame;
  std::int64_t stamp_utc_ns = 0;
  std::vector<std::int32_t> landmark_of;  // per keypoint: index into the snapshot's landmarks, or kUnmatched
  int matches = 0;
  PoseSolution solution;
  Timing timing;

  // Scratch.
  std::vector<ProjectedLandmark> projected;
  std::vector<PoseObservation> observations;
  std::vector<std::uint16_t> observed_keypoint;
  std::vector<std::uint8_t> landmark_taken;

  // From frame to frame.
  TrackingState state = TrackingState::Initializing;
  std::vector<LandmarkId> last_landmarks;  // inliers of the last frame, ascending
  KeyframeId last_keyframe = kNoKeyframe;
  int frames_since_keyframe = 0;
  int reference_inliers = 0;  // best seen since the mapper took the last keyframe in
  bool needs_map = true;      // the next good frame begins one
  std::uint32_t map_id = 0;
  KeyframeId map_begin = kNoKeyframe;  // last keyframe before the map began
  std::size_t next_recovery = 0;       // index into the snapshot's keyframes, newest first
};

Tracker::Impl::Impl(const TrackerConfig& tracker, const MapperConfig& mapper, const CameraIntrinsics& intrinsics,
                    const Se3& T_map_camera_start)
    : config(tracker),
      camera(intrinsics),
      noise(tracker, intrinsics),
      extractor(tracker, intrinsics.width, intrinsics.height),
      matcher(camera, tracker),
      recovery(camera, tracker),
      T_map_start(T_map_camera_start),
      frame(camera, feature_capacity(tracker.features)) {
  const std::size_t features = feature_capacity(config.features);
  const auto landmarks = static_cast<std::size_t>(mapper.local_landmarks);
  landmark_of.reserve(features);
  observations.reserve(features);
  observed_keypoint.reserve(features);
  last_landmarks.reserve(features);
  projected.reserve(landmarks);
  landmark_taken.reserve(landmarks);
}

/// The first keyframe of a map defines it. A frame without enough depth, or a mapper that cannot take it, leaves everything as it
/// is.
void Tracker::Impl::initialize(const KeyframeRecord* candidate) {
  const auto depths = std::count_if(frame.depth_m().begin(), frame.depth_m().end(), [](float z) { return z > 0; });
  if (candidate == nullptr || depths < kMinDepthsToInitialize) {
    return;
  }
  ++map_id;
  map_begin = last_keyframe;
  needs_map = false;
  solution = PoseSolution{};
  solution.T_map_camera = T_map_start;
  solution.solved = true;
  motion.restart();
  state = TrackingState::Tracking;
}

void Tracker::Impl::match_last_frame(const MapSnapshot& map, const Se3& T_map_camera, float radius) {
  // Both lists ascend, so one walk finds the landmarks that are still in the snapshot. After a map's first frame all are as good.
  std::size_t next = 0;
  const auto was_tracked = [&](std::uint32_t l) {
    while (next < last_landmarks.size() && last_landmarks[next] < map.landmarks[l].id) {
      ++next;
    }
    return last_landmarks.empty() || (next < last_landmarks.size() && last_landmarks[next] == map.landmarks[l].id);
  };
  matcher.project_where(map, T_map_camera, frame, was_tracked, projected);
  landmark_of.assign(frame.size(), kUnmatched);
  MatchOptions options;
  options.radius = radius;
  matches = matcher.match(map, projected, frame, options, landmark_of);
}

/// Adds matches with the landmarks of the local map that have none yet.
void Tracker::Impl::match_local_map(const MapSnapshot& map, const Se3& T_map_camera) {
  landmark_taken.assign(map.landmarks.size(), 0);
  for (const std::int32_t landmark : landmark_of) {
    if (landmark != kUnmatched) {
      landmark_taken[static_cast<std::size_t>(landmark)] = 1;
    }
  }
  const auto is_free = [&](std::uint32_t l) { return landmark_taken[l] == 0; };
  matcher.project_where(map, T_map_camera, frame, is_free, projected);
  MatchOptions options;
  options.radius = kLocalMapRadius;
  matches += matcher.match(map, projected, frame, options, landmark_of);
}

/// Solves for the pose from the present matches; outliers lose their match.
PoseSolution Tracker::Impl::solve(const MapSnapshot& map, const Se3& initial) {
  const TimeNs begin_ns = now_ns();
  observations.clear();
  observed_keypoint.clear();
  for (std::size_t i = 0; i < landmark_of.size(); ++i) {
    if (landmark_of[i] == kUnmatched) {
      continue;
    }
    const int level = frame.features().keypoints[i].level;
    const double z = frame.depth_m()[i];
    observations.push_back({map.landmarks[static_cast<std::size_t>(landmark_of[i])].p_map.cast<double>(),
                            frame.ideal_pixels()[i].cast<double>(), frame.disparity()[i], noise.pixel_weight(level),
                            z > 0 ? noise.disparity_weight(level, z) : 0.0, true});
    observed_keypoint.push_back(static_cast<std::uint16_t>(i));
  }
  const PoseSolution result = solve_pose(camera, initial, observations);
  for (std::size_t j = 0; j < observations.size(); ++j) {
    if (!observations[j].inlier) {
      landmark_of[observed_keypoint[j]] = kUnmatched;
    }
  }
  timing.solve_ns += now_ns() - begin_ns;
  return result;
}

bool Tracker::Impl::track_by_motion(const MapSnapshot& map) {
  const Se3 predicted = motion.predict(stamp_utc_ns);
  match_last_frame(map, predicted, kPredictedRadius);
  if (matches < kFewMatches) {
    match_last_frame(map, predicted, kWideRadius);
  }
  solution = solve(map, predicted);
  return solution.solved && refine_in_local_map(map);
}

bool Tracker::Impl::refine_in_local_map(const MapSnapshot& map) {
  match_local_map(map, solution.T_map_camera);
  solution = solve(map, solution.T_map_camera);
  return solution.solved && solution.inliers >= config.min_inliers;
}

bool Tracker::Impl::recover(const MapSnapshot& map) {
  for (int i = 0; i < kRecoveriesPerFrame && !map.keyframes.empty(); ++i) {
    const SnapshotKeyframe& keyframe = map.keyframes[next_recovery++ % map.keyframes.size()];
    const auto recovered = recovery.recover(map, keyframe, frame, kMinRecoveryInliers);
    if (!recovered) {
      continue;
    }
    landmark_of.assign(frame.size(), kUnmatched);
    matches = 0;
    solution.T_map_camera = recovered->T_map_camera;
    // Twice: the first pose rests on few matches, so the first search may miss much of the local map.
    if (refine_in_local_map(map) && refine_in_local_map(map)) {
      motion.restart();
      return true;
    }
  }
  return false;
}

bool Tracker::Impl::wants_keyframe(const MapSnapshot& map) {
  if (map.newest_keyframe < last_keyframe) {
    return false;  // the mapper has not taken in the last one yet
  }
  reference_inliers = std::max(reference_inliers, solution.inliers);
  int close_tracked = 0;
  int close_untracked = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame.depth_m()[i] > 0 && frame.depth_m()[i] < config.close_depth_m) {
      ++(landmark_of[i] == kUnmatched ? close_untracked : close_tracked);
    }
  }
  return frames_since_keyframe >= config.keyframe_max_interval ||
         solution.inliers < config.keyframe_inlier_ratio * reference_inliers ||
         (close_tracked < kCloseTracked && close_untracked > kCloseUntracked);
}

void Tracker::Impl::fill_keyframe(KeyframeRecord& record, const MapSnapshot& map) {
  record.id = ++last_keyframe;
  record.T_map_camera = solution.T_map_camera;
  record.covariance = solution.covariance;
  record.map_id = map_id;
  record.features.keypoints = frame.features().keypoints;
  record.features.descriptors = frame.features().descriptors;
  record.ideal_pixels = frame.ideal_pixels();
  record.depth_m = frame.depth_m();
  record.landmarks.resize(frame.size());
  for (std::size_t i = 0; i < frame.size(); ++i) {
    record.landmarks[i] = landmark_of[i] == kUnmatched ? kNoLandmark : map.landmarks[static_cast<std::size_t>(landmark_of[i])].id;
  }
  frames_since_keyframe = 0;
  reference_inliers = 0;
}

/// Keeps what the next frame is predicted from.
void Tracker::Impl::remember(const MapSnapshot& map) {
  motion.observe(solution.T_map_camera, stamp_utc_ns);
  last_landmarks.clear();
  for (const std::int32_t landmark : landmark_of) {
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
    estimate.T_reference_camera = map.keyframes.front().T_map_camera.inverse() * solution.T_map_camera;
  }
}

/// Tracks, or recovers, or says that the camera is lost.
void Tracker::Impl::find_camera(const MapSnapshot& map) {
  if (map.version == 0 || map.map_id != map_id) {
    state = TrackingState::Initializing;  // the mapper is still busy with the first keyframe
    return;
  }
  if (state != TrackingState::Lost) {
    next_recovery = 0;  // just lost, it is most likely near the newest keyframes
    if (track_by_motion(map)) {
      state = TrackingState::Tracking;
      return;
    }
  }
  if (recover(map)) {
    state = TrackingState::Tracking;
    return;
  }
  needs_map = last_keyframe - map_begin < kYoungMapKeyframes;
  state = needs_map ? TrackingState::Initializing : TrackingState::Lost;
}

PoseEstimate Tracker::Impl::track(const RgbdFrame& rgbd, const MapSnapshot& map, KeyframeRecord* candidate) {
  const TimeNs begin_ns = now_ns();
  timing = Timing{};
  stamp_utc_ns = rgbd.stamp_utc_ns;
  extractor.extract(rgbd.gray, frame.features());
  frame.place(camera, rgbd.depth_m);
  const TimeNs extracted_ns = now_ns();
  timing.extract_ns = extracted_ns - begin_ns;
  landmark_of.assign(frame.size(), kUnmatched);
  matches = 0;
  ++frames_since_keyframe;

  const bool starts_map = needs_map;
  if (needs_map) {
    initialize(candidate);
  } else {
    find_camera(map);
  }

  PoseEstimate estimate;
  estimate.sequence = rgbd.sequence;
  estimate.capture_ns = rgbd.capture_ns;
  estimate.stamp_utc_ns = rgbd.stamp_utc_ns;
  estimate.state = state;
  estimate.keypoints = static_cast<std::int32_t>(frame.size());
  estimate.matches = matches;
  estimate.map_id = map_id;
  estimate.map_version = map.version;
  if (state == TrackingState::Tracking) {
    estimate.T_map_odom = map.T_map_odom;
    estimate.T_odom_camera = map.T_map_odom.inverse() * solution.T_map_camera;
    estimate.covariance = solution.covariance;
    estimate.inliers = solution.inliers;
    estimate.keyframe = candidate != nullptr && (starts_map || wants_keyframe(map));
    if (estimate.keyframe) {
      fill_keyframe(*candidate, map);
      candidate->starts_map = starts_map;
      candidate->sequence = rgbd.sequence;
      candidate->capture_ns = rgbd.capture_ns;
    }
    refer_to_keyframe(map, estimate);
    remember(map);
  }
  estimate.track_ns = now_ns() - begin_ns;
  timing.match_ns = estimate.track_ns - timing.extract_ns - timing.solve_ns;
  return estimate;
}

Tracker::Tracker(const TrackerConfig& config, const MapperConfig& mapper, const CameraIntrinsics& camera,
                 const Se3& T_map_camera_start)
    : impl_(std::make_unique<Impl>(config, mapper, camera, T_map_camera_start)) {}
Tracker::~Tracker() = default;

PoseEstimate Tracker::track(const RgbdFrame& frame, const MapSnapshot& map, KeyframeRecord* candidate) {
  return impl_->track(frame, map, candidate);
}

const Tracker::Timing& Tracker::last_timing() const {
  return impl_->timing;
}

}  // namespace posed
