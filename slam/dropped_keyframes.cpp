#include "slam/dropped_keyframes.h"

namespace posed {

void DroppedKeyframes::store(KeyframeId keyframe, const Place& place) {
  places_[keyframe] = place;
  if (places_.size() > kCapacity) {
    places_.erase(places_.begin());
  }
}

void DroppedKeyframes::remember(const Map& map, KeyframeId keyframe, KeyframeId anchor) {
  store(keyframe, {anchor, map.find_keyframe(anchor)->T_map_camera.inverse() * map.find_keyframe(keyframe)->T_map_camera});
}

void DroppedKeyframes::remember_fixed(KeyframeId keyframe, const Se3& T_map_camera) {
  store(keyframe, {kNoKeyframe, T_map_camera});
}

std::optional<Se3> DroppedKeyframes::find_pose(const Map& map, KeyframeId keyframe) const {
  // An anchor may itself have been dropped, but only later than what hangs on it, so this ends.
  Se3 T_found_wanted;
  while (true) {
    if (const Keyframe* const found = map.find_keyframe(keyframe)) {
      return found->T_map_camera * T_found_wanted;
    }
    const auto it = places_.find(keyframe);
    if (it == places_.end()) {
      return std::nullopt;
    }
    T_found_wanted = it->second.T_anchor_keyframe * T_found_wanted;
    keyframe = it->second.anchor;
    if (keyframe == kNoKeyframe) {
      return T_found_wanted;
    }
  }
}

}  // namespace posed
