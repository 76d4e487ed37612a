#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "config/config.h"
#include "slam/interrupt.h"
#include "slam/keyframe_record.h"
#include "slam/landmark_estimator.h"
#include "slam/landmark_fusion.h"
#include "slam/landmark_triangulation.h"
#include "slam/map.h"
#include "slam/map_adjuster.h"

namespace posed {

/// What happens to the map around a new keyframe: landmarks are measured again, judged, made and joined; the neighbourhood is
/// adjusted; keyframes that tell nothing new go. Thread-bound to the mapper.
class LocalMapper {
 public:
  /// Everything passed in must outlive it.
  LocalMapper(const TrackerConfig& tracker, const MapperConfig& config, const LandmarkEstimator& estimator, Map& map);

  /// Takes a keyframe in, at `T_map_camera` of map `map_id`, which may have changed since the tracker wrote them: links its
  /// matches, which move their landmarks; removes landmarks that keyframes keep missing; makes landmarks of its depths. Short: the
  /// tracker waits for its outcome.
  void insert(const KeyframeRecord& record, std::uint32_t map_id, const Se3& T_map_camera);

  /// Looks at the neighbours of a keyframe: triangulates what has no trusted depth, joins landmarks that are the same point.
  /// Gives up between two neighbours where interrupted.
  void extend(KeyframeId keyframe, const Interrupt& interrupt);

  /// Bundle adjustment of the keyframe's neighbourhood.
  BundleSummary adjust(KeyframeId keyframe, const Interrupt& interrupt);

  /// Neighbours of `keyframe` that may be dropped: not one of the `kept_newest` newest, nor a root of the spanning tree, nor one
  /// that holds a loop together.
  std::vector<KeyframeId> droppable_keyframes(KeyframeId keyframe, std::size_t kept_newest) const;

  /// Share of a keyframe's landmarks that at least three others see at least as well, 0 to 1.
  double redundancy(const Keyframe& keyframe) const;

  /// Whether that is nearly all of them (Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015, section VI-E).
  bool is_redundant(const Keyframe& keyframe) const;

  MapAdjuster& adjuster() { return adjuster_; }
  LandmarkFusion& fusion() { return fusion_; }

 private:
  void link_to_tree(const KeyframeRecord& record);
  void extend_observed(const KeyframeRecord& record);
  void judge_predicted(const KeyframeRecord& record);
  void remove_unconfirmed(KeyframeId newest);
  void create_from_depth(const KeyframeRecord& record);

  double close_depth_m_;
  MapperConfig config_;
  const LandmarkEstimator& estimator_;
  Map& map_;
  LandmarkTriangulation triangulation_;
  LandmarkFusion fusion_;
  MapAdjuster adjuster_;
  std::deque<KeyframeId> unconfirmed_;  // keyframes that showed movers, whose landmarks are still to be found again
};

}  // namespace posed
