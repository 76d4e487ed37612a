#pragma once

#include <vector>

#include "config/config.h"
#include "slam/map.h"
#include "slam/map_snapshot.h"

namespace posed {

/// The part of a map around one keyframe.
struct LocalMap {
  std::vector<KeyframeId> keyframes;  ///< that keyframe, then those that share most landmarks with it, then the nearest
  std::vector<LandmarkId> landmarks;  ///< seen by those keyframes; ascending
};

/// At most `max_keyframes` keyframes of the map of `centre`, and `max_landmarks` landmarks: those of the later keyframes are left
/// out first. Reentrant.
LocalMap select_local_map(const Map& map, KeyframeId centre, std::size_t max_keyframes, std::size_t max_landmarks);

/// Overwrites landmarks, their anchors and keyframes (at most `max_keyframes`) of the snapshot; its vectors keep their capacity.
/// Reentrant.
void write_local_map(const Map& map, const LocalMap& local, std::size_t max_keyframes, MapSnapshot& snapshot);

}  // namespace posed
