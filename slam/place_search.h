#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "config/config.h"
#include "slam/feature_frame.h"
#include "slam/local_map.h"
#include "slam/map.h"
#include "slam/map_snapshot.h"
#include "slam/place_recognizer.h"
#include "slam/place_verifier.h"

namespace posed {

/// A keyframe that shows what a frame shows.
struct ConfirmedPlace {
  KeyframeId keyframe = kNoKeyframe;
  PlaceMatch match;  ///< pose of the frame in that keyframe's map
};

/// Finds what a frame shows among the keyframes of all maps: candidates by appearance (PlaceRecognizer), each checked in geometry
/// against its surroundings (PlaceVerifier). Keeps scratch memory. Thread-bound to the mapper.
class PlaceSearch {
 public:
  /// Everything passed in must outlive it, but for `camera`.
  PlaceSearch(const TrackerConfig& tracker, const PinholeCamera& camera, const PlaceRecognizer& places, const Map& map);

  struct Options {
    std::size_t candidates = 3;  ///< checked at most
    int min_inliers = 40;        ///< landmarks that a match must rest on
  };

  /// The confirmed ones among those that `eligible` admits, in the order of their likeness. The frame is given as a keyframe keeps
  /// it.
  std::vector<ConfirmedPlace> find(const Features& features, const std::vector<Eigen::Vector2f>& ideal_pixels,
                                   const std::vector<float>& depth_m, const std::function<bool(KeyframeId)>& eligible,
                                   const Options& options);

  /// What a candidate is checked against.
  LocalMap surroundings(KeyframeId keyframe) const;

 private:
  PinholeCamera camera_;
  const PlaceRecognizer& places_;
  const Map& map_;
  PlaceVerifier verifier_;
  FeatureFrame frame_;
  MapSnapshot around_;
  std::vector<PlaceCandidate> candidates_;
};

}  // namespace posed
