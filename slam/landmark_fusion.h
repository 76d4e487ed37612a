#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "slam/feature_frame.h"
#include "slam/landmark_estimator.h"
#include "slam/map.h"
#include "slam/map_snapshot.h"
#include "slam/projection_matcher.h"

namespace posed {

/// Finds landmarks in keyframes that should see them but are not linked to them: a landmark is projected into the keyframe and
/// matched there; a free keypoint is linked to it, and where the keypoint belongs to another landmark, the two are the same point
/// and become one (Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015, section VI). Keeps scratch memory. Thread-bound.
class LandmarkFusion {
 public:
  LandmarkFusion(const LandmarkEstimator& estimator, const TrackerConfig& config);

  struct Options {
    float radius = 3.0F;  ///< [pixels on level 0] around the projection
    bool gated = true;    ///< the measurement must agree with the landmark's position; off where the map is not yet adjusted
  };

  /// Searches `landmarks` (those that are gone are left out) in `keyframe`; the number of links and merges made.
  int fuse(Map& map, std::span<const LandmarkId> landmarks, KeyframeId keyframe, const Options& options);

 private:
  bool join(Map& map, LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint, bool gated);

  const LandmarkEstimator& estimator_;
  ProjectionMatcher matcher_;
  FeatureFrame frame_;
  MapSnapshot candidates_;
  std::vector<ProjectedLandmark> projected_;
  std::vector<std::int32_t> landmark_of_;
};

}  // namespace posed
