#include "slam/place_verifier.h"

#include <algorithm>
#include <bitset>

namespace posed {

namespace {

constexpr int kSeedInliers = 12;      // that RANSAC must find before the surroundings are searched
constexpr float kSeedRadius = 10.0F;  // [pixels on level 0]
constexpr int kColumns = 8;
constexpr int kRows = 6;
constexpr std::size_t kLandmarkCapacity = 4000;

int cell_of(float position, int size, int cells) {
  return std::clamp(static_cast<int>(position * static_cast<float>(cells) / static_cast<float>(size)), 0, cells - 1);
}

}  // namespace

PlaceVerifier::PlaceVerifier(const PinholeCamera& camera, const TrackerConfig& config)
    : intrinsics_(camera.intrinsics()), recovery_(camera, config), localizer_(camera, config, kLandmarkCapacity) {}

std::optional<PlaceMatch> PlaceVerifier::verify(const MapSnapshot& around, const SnapshotKeyframe& candidate,
                                                const FeatureFrame& frame, int min_inliers) {
  const auto seed = recovery_.recover(around, candidate, frame, std::min(kSeedInliers, min_inliers));
  if (!seed) {
    return std::nullopt;
  }
  // Twice: the first pose rests on one keyframe's matches, so the first search is wide and may still miss much.
  localizer_.match(around, frame, {}, seed->T_map_camera, kSeedRadius);
  if (!localizer_.solve(around, frame, seed->T_map_camera) || !localizer_.refine(around, frame, min_inliers)) {
    return std::nullopt;
  }
  PlaceMatch match;
  match.T_map_camera = localizer_.solution().T_map_camera;
  match.covariance = localizer_.solution().covariance;
  match.inliers = localizer_.solution().inliers;
  std::bitset<kColumns * kRows> covered;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const std::int32_t landmark = localizer_.landmark_of()[i];
    if (landmark != kUnmatched) {
      match.matches.emplace_back(static_cast<std::uint16_t>(i), around.landmarks[static_cast<std::size_t>(landmark)].id);
      const Eigen::Vector2f& pixel = frame.ideal_pixels()[i];
      covered.set(static_cast<std::size_t>(cell_of(pixel.y(), intrinsics_.height, kRows) * kColumns +
                                           cell_of(pixel.x(), intrinsics_.width, kColumns)));
    }
  }
  match.covered = static_cast<double>(covered.count()) / static_cast<double>(covered.size());
  return match;
}

}  // namespace posed
