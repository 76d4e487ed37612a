#include "slam/place_verifier.h"

#include <algorithm>
#include <bitset>

namespace posed {

namespace {

// Enough matches with one keyframe to begin with: three fix the pose, the others vouch for it. The guided matching asks for more.
constexpr int kFirstInliers = 12;
constexpr float kFirstRadius = 10.0F;  // [pixels on level 0] the first pose rests on one keyframe's matches
constexpr float kFinalRadius = 5.0F;
constexpr int kGridColumns = 8;
constexpr int kGridRows = 6;

}  // namespace

PlaceVerifier::PlaceVerifier(const PinholeCamera& camera, const TrackerConfig& config)
    : camera_(camera), noise_(config, camera.intrinsics()), recovery_(camera, config), matcher_(camera, config) {}

PoseSolution PlaceVerifier::refine(const MapSnapshot& map, const Se3& T_map_camera, const FeatureFrame& frame, float radius) {
  matcher_.project_where(
      map, T_map_camera, frame, [](std::uint32_t) { return true; }, projected_);
  landmark_of_.assign(frame.size(), kUnmatched);
  MatchOptions options;
  options.radius = radius;
  matcher_.match(map, projected_, frame, options, landmark_of_);
  keypoints_.clear();
  observations_.clear();
  for (std::size_t i = 0; i < landmark_of_.size(); ++i) {
    if (landmark_of_[i] == kUnmatched) {
      continue;
    }
    const int level = frame.features().keypoints[i].level;
    const double z = frame.depth_m()[i];
    keypoints_.push_back(static_cast<std::uint16_t>(i));
    observations_.push_back({map.landmarks[static_cast<std::size_t>(landmark_of_[i])].p_map.cast<double>(),
                             frame.ideal_pixels()[i].cast<double>(), frame.disparity()[i], noise_.pixel_weight(level),
                             z > 0 ? noise_.disparity_weight(level, z) : 0.0, true});
  }
  return solve_pose(camera_, T_map_camera, observations_);
}

double PlaceVerifier::covered_share(const FeatureFrame& frame, const PlaceMatch& match) const {
  std::bitset<kGridColumns * kGridRows> covered;
  for (const auto& [keypoint, landmark] : match.matches) {
    const Keypoint& k = frame.features().keypoints[keypoint];
    const int column = static_cast<int>(k.x) * kGridColumns / camera_.intrinsics().width;
    const int row = static_cast<int>(k.y) * kGridRows / camera_.intrinsics().height;
    covered.set(
        static_cast<std::size_t>(std::clamp(row, 0, kGridRows - 1) * kGridColumns + std::clamp(column, 0, kGridColumns - 1)));
  }
  return static_cast<double>(covered.count()) / static_cast<double>(covered.size());
}

std::optional<PlaceMatch> PlaceVerifier::verify(const MapSnapshot& map, const SnapshotKeyframe& keyframe, const FeatureFrame& frame,
                                                int min_inliers) {
  const auto recovered = recovery_.recover(map, keyframe, frame, std::min(kFirstInliers, min_inliers));
  if (!recovered) {
    return std::nullopt;
  }
  Se3 T_map_camera = recovered->T_map_camera;
  PoseSolution solution;
  for (const float radius : {kFirstRadius, kFinalRadius}) {
    solution = refine(map, T_map_camera, frame, radius);
    if (!solution.solved) {
      return std::nullopt;
    }
    T_map_camera = solution.T_map_camera;
  }
  if (solution.inliers < min_inliers) {
    return std::nullopt;
  }
  PlaceMatch match{solution.T_map_camera, solution.covariance, solution.inliers, {}, 0};
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (observations_[i].inlier) {
      const auto landmark = static_cast<std::size_t>(landmark_of_[keypoints_[i]]);
      match.matches.emplace_back(keypoints_[i], map.landmarks[landmark].id);
    }
  }
  match.covered = covered_share(frame, match);
  return match;
}

}  // namespace posed
