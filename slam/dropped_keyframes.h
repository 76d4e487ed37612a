#pragma once

#include <map>
#include <optional>

#include "slam/map.h"

namespace posed {

/// Remembers where keyframes are that a map has dropped, relative to one that it kept, so that a trajectory can be rebuilt after
/// the map has moved. Bounded: the oldest are forgotten first. Thread-bound.
class DroppedKeyframes {
 public:
  /// Call before the keyframe is removed; `anchor` stays in the map for now.
  void remember(const Map& map, KeyframeId keyframe, KeyframeId anchor);

  /// For a keyframe whose whole map goes: its pose is final. Also for a visit of a map that does not change.
  void remember_fixed(KeyframeId keyframe, const Se3& T_map_camera);

  /// Present pose, of one in the map too; nothing where it was never known or is forgotten.
  std::optional<Se3> find_pose(const Map& map, KeyframeId keyframe) const;

 private:
  static constexpr std::size_t kCapacity = 100'000;

  struct Place {
    KeyframeId anchor = kNoKeyframe;  ///< none: the map frame
    Se3 T_anchor_keyframe;
  };
  void store(KeyframeId keyframe, const Place& place);

  std::map<KeyframeId, Place> places_;
};

}  // namespace posed
