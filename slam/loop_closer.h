#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "config/config.h"
#include "core/result.h"
#include "slam/interrupt.h"
#include "slam/local_mapper.h"
#include "slam/map.h"
#include "slam/place_recognizer.h"
#include "slam/place_search.h"

namespace posed {

/// What a closed loop or a joining of two maps did.
struct LoopCorrection {
  bool joined_maps = false;  ///< else a loop within one map
  Se3 T_corrected_previous;  ///< what the newest keyframe's pose was moved by: T_map_camera = this * its former T_map_camera
  KeyframeId keyframe = kNoKeyframe;
  KeyframeId matched = kNoKeyframe;
  double correction_m = 0;  ///< by how far the keyframe moved
};

/// Counted since the start.
struct LoopCounters {
  std::uint64_t implausible = 0;  ///< confirmed places that were refused because they ask for more drift than can be
  std::uint64_t closed = 0;
  std::uint64_t joined = 0;
};

/// Finds out that the camera is at a place it has seen before, and corrects the map by it. A closure needs: candidates by
/// appearance (PlaceRecognizer); agreement in geometry (PlaceVerifier); a correction that the drift along the shortest path in
/// the map's graph between the two keyframes explains; and the same correction from `kAgreeing` keyframes of the last few.
/// Thread-bound to the mapper.
class LoopCloser {
 public:
  /// Everything passed in must outlive it.
  LoopCloser(const TrackerConfig& tracker, const MapperConfig& config, const LandmarkEstimator& estimator, LocalMapper& mapper,
             const PlaceRecognizer& places, Map& map);

  /// Looks for an earlier place in what `keyframe`, the newest, shows, and corrects the map where it is sure of one. The caller
  /// should adjust the whole map afterwards. Errors: of the pose graph; the map is unchanged then.
  Result<std::optional<LoopCorrection>> close(KeyframeId keyframe);

  const LoopCounters& counters() const { return counters_; }

 private:
  /// A keyframe that an earlier one was verified against.
  struct Detection {
    KeyframeId keyframe = kNoKeyframe;
    KeyframeId matched = kNoKeyframe;
    std::uint32_t matched_map = 0;
    std::uint64_t seen = 0;  ///< count of keyframes then
    PlaceMatch match;        ///< pose of `keyframe` in the map of `matched`
    Se3 T_keyframe_matched;
  };

  std::optional<Detection> detect(KeyframeId keyframe);
  bool is_plausible(const Detection& detection, double path_m) const;
  bool is_agreed(const Detection& detection);
  Result<LoopCorrection> correct_loop(const Detection& detection);
  LoopCorrection join_maps(const Detection& detection);
  void fuse_around(const Detection& detection);

  MapperConfig config_;
  const LandmarkEstimator& estimator_;
  LocalMapper& mapper_;
  Map& map_;
  PlaceSearch search_;
  std::deque<Detection> recent_;
  std::uint64_t keyframes_seen_ = 0;
  LoopCounters counters_;
};

}  // namespace posed
