#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "slam/bundle_adjuster.h"
#include "slam/landmark_estimator.h"
#include "slam/map.h"

namespace posed {

/// Bundle adjustment of parts of a map: takes the values out, has them adjusted, and writes poses and landmarks back; observations
/// that turn out to be wrong lose their link. Keeps scratch memory. Thread-bound.
class MapAdjuster {
 public:
  explicit MapAdjuster(const LandmarkEstimator& estimator);

  struct Window {
    std::size_t free_keyframes = 20;   ///< that keyframe and those most covisible with it
    std::size_t fixed_keyframes = 20;  ///< others that see the same landmarks
    int iterations = 5;                ///< a round
  };
  /// The neighbourhood of `centre`; the map's oldest keyframe stays where it is.
  BundleSummary adjust_around(Map& map, KeyframeId centre, const Window& window, const Interrupt& interrupt);

  /// The whole map; its oldest keyframe stays where it is.
  BundleSummary adjust_all(Map& map, std::uint32_t map_id, int iterations, const Interrupt& interrupt);

 private:
  void begin();
  void add_camera(const Map& map, KeyframeId keyframe, bool fixed);
  void add_landmarks_of(const Map& map, KeyframeId keyframe);
  void add_observations(const Map& map);
  BundleSummary adjust(Map& map, int iterations, const Interrupt& interrupt);

  const LandmarkEstimator& estimator_;
  BundleAdjuster adjuster_;
  BundleProblem problem_;
  std::vector<KeyframeId> cameras_;  // index: camera of the problem
  std::unordered_map<KeyframeId, std::uint32_t> camera_of_;
  std::vector<LandmarkId> points_;  // index: point of the problem
  std::unordered_map<LandmarkId, std::uint32_t> point_of_;
};

}  // namespace posed
