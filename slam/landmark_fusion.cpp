#include "slam/landmark_fusion.h"

namespace posed {

LandmarkFusion::LandmarkFusion(const LandmarkEstimator& estimator, const TrackerConfig& config)
    : estimator_(estimator), matcher_(estimator.camera(), config), frame_(estimator.camera(), feature_capacity(config.features)) {}

int LandmarkFusion::fuse(Map& map, std::span<const LandmarkId> landmarks, KeyframeId keyframe, const Options& options) {
  const Keyframe& k = *map.find_keyframe(keyframe);
  candidates_.landmarks.clear();
  for (const LandmarkId id : landmarks) {
    const Landmark* const landmark = map.find_landmark(id);
    if (landmark != nullptr && Map::keypoint_of(*landmark, keyframe) < 0) {
      candidates_.landmarks.push_back(to_snapshot(id, *landmark));
    }
  }
  frame_.place_stored(estimator_.camera(), k.features, k.ideal_pixels, k.depth_m);
  matcher_.project_where(
      candidates_, k.T_map_camera, frame_, [](std::uint32_t) { return true; }, projected_);
  landmark_of_.assign(frame_.size(), kUnmatched);
  MatchOptions match;
  match.radius = options.radius;
  matcher_.match(candidates_, projected_, frame_, match, landmark_of_);
  int joined = 0;
  for (std::size_t i = 0; i < landmark_of_.size(); ++i) {
    if (landmark_of_[i] != kUnmatched) {
      const LandmarkId id = candidates_.landmarks[static_cast<std::size_t>(landmark_of_[i])].id;
      joined += join(map, id, keyframe, static_cast<std::uint16_t>(i), options.gated) ? 1 : 0;
    }
  }
  return joined;
}

bool LandmarkFusion::join(Map& map, LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint, bool gated) {
  Landmark* const l = map.find_landmark(landmark);
  if (l == nullptr || Map::keypoint_of(*l, keyframe) >= 0) {
    return false;  // merged with another one a moment ago
  }
  const Keyframe& k = *map.find_keyframe(keyframe);
  if (gated && !LandmarkEstimator::agrees(estimator_.measure(*l, k, keypoint))) {
    return false;
  }
  LandmarkId kept = landmark;
  if (const LandmarkId present = k.landmarks[keypoint]; present == kNoLandmark) {
    map.observe(landmark, keyframe, keypoint);
  } else {
    const bool present_is_better = map.find_landmark(present)->observations.size() > l->observations.size();
    kept = present_is_better ? present : landmark;
    map.merge_landmarks(present_is_better ? landmark : present, kept);
  }
  Landmark& changed = *map.find_landmark(kept);
  estimator_.renew_information(map, changed);
  estimator_.renew_appearance(map, changed);
  return true;
}

}  // namespace posed
