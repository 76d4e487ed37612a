#include "slam/map.h"

#include <algorithm>
#include <cassert>

namespace posed {

Keyframe& Map::add_keyframe(const KeyframeRecord& record) {
  assert(record.id != kNoKeyframe && !keyframes_.contains(record.id));
  Keyframe& keyframe = keyframes_[record.id];
  keyframe.T_map_camera = record.T_map_camera;
  keyframe.features = record.features;
  keyframe.ideal_pixels = record.ideal_pixels;
  keyframe.depth_m = record.depth_m;
  keyframe.landmarks.assign(record.features.keypoints.size(), kNoLandmark);
  return keyframe;
}

LandmarkId Map::add_landmark(Landmark landmark) {
  const LandmarkId id = next_landmark_++;
  landmarks_.emplace(id, std::move(landmark));
  return id;
}

void Map::observe(LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint) {
  Landmark& l = landmarks_.at(landmark);
  Keyframe& k = keyframes_.at(keyframe);
  assert(k.landmarks[keypoint] == kNoLandmark);
  k.landmarks[keypoint] = landmark;
  l.observations.push_back({keyframe, keypoint});
}

void Map::remove_landmark(LandmarkId landmark) {
  const auto it = landmarks_.find(landmark);
  if (it == landmarks_.end()) {
    return;
  }
  for (const Observation& o : it->second.observations) {
    keyframes_.at(o.keyframe).landmarks[o.keypoint] = kNoLandmark;
  }
  landmarks_.erase(it);
}

void Map::remove_keyframe(KeyframeId keyframe) {
  const auto it = keyframes_.find(keyframe);
  if (it == keyframes_.end()) {
    return;
  }
  for (const LandmarkId id : it->second.landmarks) {
    const auto l = landmarks_.find(id);
    if (l == landmarks_.end()) {
      continue;
    }
    std::erase_if(l->second.observations, [&](const Observation& o) { return o.keyframe == keyframe; });
    if (l->second.observations.empty()) {
      landmarks_.erase(l);
    }
  }
  keyframes_.erase(it);
}

void Map::clear() {
  keyframes_.clear();
  landmarks_.clear();  // identifiers go on: those of an earlier map are never mistaken for new ones
}

Landmark* Map::find_landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

const Landmark* Map::find_landmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

const Keyframe* Map::find_keyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

}  // namespace posed
