#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/pinhole_camera.h"
#include "slam/feature_frame.h"
#include "slam/map_snapshot.h"
#include "slam/measurement_noise.h"
#include "slam/pose_solver.h"

namespace posed {

/// Finds the camera again, without a prediction, by matching a frame against one recent keyframe: nearest descriptors both ways,
/// then RANSAC with samples of three: 3D-3D over the keypoints with depth or, where most matches have none, P3P over all of them;
/// then the robust pose solver. Deterministic: the random numbers depend on the frame's content alone. Does not allocate once warm.
/// Reentrant: one object a thread.
class KeyframeRecovery {
 public:
  KeyframeRecovery(const PinholeCamera& camera, const TrackerConfig& config);

  struct Recovered {
    Se3 T_map_camera;
    int inliers = 0;
  };
  /// Nothing where fewer than `min_inliers` matches agree on a pose.
  std::optional<Recovered> recover(const MapSnapshot& map, const SnapshotKeyframe& keyframe, const FeatureFrame& frame,
                                   int min_inliers);

 private:
  struct Match {
    std::uint32_t landmark;
    std::uint16_t keypoint;
    std::uint16_t distance;
  };
  void match_descriptors(const MapSnapshot& map, const SnapshotKeyframe& keyframe, const FeatureFrame& frame);
  std::optional<Se3> align_with_depth() const;
  std::optional<Se3> align_rays() const;
  int count_agreeing(const Se3& T_map_camera) const;
  int count_seen(const Se3& T_map_camera) const;

  PinholeCamera camera_;
  MeasurementNoise noise_;
  std::vector<Match> matches_;
  std::vector<std::int32_t> match_of_keypoint_;  // index into matches_
  std::vector<std::uint16_t> distances_;
  std::vector<Eigen::Vector3d> p_map_;     // of the matches with depth
  std::vector<Eigen::Vector3d> p_camera_;  // likewise
  std::vector<PoseObservation> observations_;
};

}  // namespace posed
