#pragma once

#include <optional>
#include <vector>

#include "config/config.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_record.h"
#include "slam/map.h"
#include "slam/map_snapshot.h"
#include "slam/place_recognizer.h"
#include "slam/place_verifier.h"

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
  PinholeCamera camera_;
  int min_inliers_;
  const PlaceRecognizer& places_;
  const Map& map_;
  PlaceVerifier verifier_;
  FeatureFrame frame_;
  MapSnapshot around_;
  std::vector<PlaceCandidate> candidates_;
};

}  // namespace posed
