#include "slam/frame_localizer.h"

#include <utility>

#include "core/clock.h"

namespace posed {

namespace {

constexpr float kLocalMapRadius = 5.0F;  // [pixels on level 0] around the local map's landmarks once the pose is nearly known

}  // namespace

FrameLocalizer::FrameLocalizer(const PinholeCamera& camera, const TrackerConfig& config, std::size_t landmark_capacity)
    : camera_(camera), noise_(config, camera.intrinsics()), matcher_(camera, config) {
  const std::size_t features = feature_capacity(config.features);
  result_.landmark_of.reserve(features);
  observations_.reserve(features);
  observed_keypoint_.reserve(features);
  projected_.reserve(landmark_capacity);
  landmark_taken_.reserve(landmark_capacity);
}

void FrameLocalizer::reset(const FeatureFrame& frame) {
  result_.landmark_of.assign(frame.size(), kUnmatched);
  result_.matches = 0;
  result_.solution = PoseSolution{};
}

void FrameLocalizer::begin_at(const FeatureFrame& frame, const Se3& T_map_camera) {
  reset(frame);
  result_.solution.T_map_camera = T_map_camera;
  result_.solution.solved = true;
}

void FrameLocalizer::match(const MapSnapshot& map, const FeatureFrame& frame, std::span<const LandmarkId> wanted,
                           const Se3& T_map_camera, float radius) {
  // Both lists ascend, so one walk finds the wanted landmarks.
  std::size_t next = 0;
  const auto is_wanted = [&](std::uint32_t l) {
    while (next < wanted.size() && wanted[next] < map.landmarks[l].id) {
      ++next;
    }
    return wanted.empty() || (next < wanted.size() && wanted[next] == map.landmarks[l].id);
  };
  matcher_.project_where(map, T_map_camera, frame, is_wanted, projected_);
  result_.landmark_of.assign(frame.size(), kUnmatched);
  MatchOptions options;
  options.radius = radius;
  result_.matches = matcher_.match(map, projected_, frame, options, result_.landmark_of);
}

bool FrameLocalizer::solve(const MapSnapshot& map, const FeatureFrame& frame, const Se3& initial) {
  const TimeNs begin_ns = SystemClock::instance().now_ns();
  observations_.clear();
  observed_keypoint_.clear();
  for (std::size_t i = 0; i < result_.landmark_of.size(); ++i) {
    if (result_.landmark_of[i] == kUnmatched) {
      continue;
    }
    const int level = frame.features().keypoints[i].level;
    const double z = frame.depth_m()[i];
    const double trust = frame.trust()[i];
    observations_.push_back({map.landmarks[static_cast<std::size_t>(result_.landmark_of[i])].p_map.cast<double>(),
                             frame.ideal_pixels()[i].cast<double>(), frame.disparity()[i], trust * noise_.pixel_weight(level),
                             z > 0 ? trust * noise_.disparity_weight(level, z) : 0.0, true});
    observed_keypoint_.push_back(static_cast<std::uint16_t>(i));
  }
  result_.solution = solve_pose(camera_, initial, observations_);
  for (std::size_t j = 0; j < observations_.size(); ++j) {
    if (!observations_[j].inlier) {
      result_.landmark_of[observed_keypoint_[j]] = kUnmatched;
    }
  }
  solve_ns_ += SystemClock::instance().now_ns() - begin_ns;
  return result_.solution.solved;
}

bool FrameLocalizer::refine(const MapSnapshot& map, const FeatureFrame& frame, int min_inliers) {
  landmark_taken_.assign(map.landmarks.size(), 0);
  for (const std::int32_t landmark : result_.landmark_of) {
    if (landmark != kUnmatched) {
      landmark_taken_[static_cast<std::size_t>(landmark)] = 1;
    }
  }
  const auto is_free = [&](std::uint32_t l) { return landmark_taken_[l] == 0; };
  matcher_.project_where(map, result_.solution.T_map_camera, frame, is_free, projected_);
  MatchOptions options;
  options.radius = kLocalMapRadius;
  result_.matches += matcher_.match(map, projected_, frame, options, result_.landmark_of);
  return solve(map, frame, result_.solution.T_map_camera) && result_.solution.inliers >= min_inliers;
}

TimeNs FrameLocalizer::take_solve_ns() {
  return std::exchange(solve_ns_, 0);
}

}  // namespace posed
