#pragma once

#include <optional>

#include "config/config.h"
#include "slam/keyframe_record.h"
#include "slam/map.h"
#include "slam/place_search.h"

namespace posed {

/// Finds where a frame was taken, anywhere in any map: candidates by appearance, confirmed by geometry. Thread-bound to the mapper.
class Relocalizer {
 public:
  /// Everything passed in must outlive it.
  Relocalizer(const TrackerConfig& tracker, const PinholeCamera& camera, const PlaceRecognizer& places, const Map& map);

  struct Found {
    KeyframeId keyframe = kNoKeyframe;  ///< that shows the same place
    Se3 T_map_camera;                   ///< of the frame, in that keyframe's map
  };
  /// Nothing where no place is confirmed, or two that lie apart are confirmed alike.
  std::optional<Found> find(const KeyframeRecord& frame);

 private:
  int min_inliers_;
  const Map& map_;
  PlaceSearch search_;
};

}  // namespace posed
