#pragma once

#include <cstddef>
#include <optional>

#include "config/config.h"
#include "slam/local_mapper.h"
#include "slam/map.h"

namespace posed {

/// Keeps the maps within their budgets of keyframes and landmarks, at a bounded cost a call: it looks at a few keyframes, and goes
/// on from there next time. Thread-bound.
class MapBudget {
 public:
  /// Everything passed in must outlive it.
  MapBudget(const MapperConfig& config, const LocalMapper& mapper, Map& map);

  /// A keyframe to drop, the one that tells least of those looked at, where there are too many; never `newest` nor a neighbour of
  /// it.
  std::optional<KeyframeId> excess_keyframe(KeyframeId newest);

  /// Removes landmarks that one keyframe alone saw, then those seen by two, and so on, until they are few enough.
  void limit_landmarks();

 private:
  MapperConfig config_;
  const LocalMapper& mapper_;
  Map& map_;
  KeyframeId cursor_ = kNoKeyframe;
};

}  // namespace posed
