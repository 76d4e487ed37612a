#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/pinhole_camera.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_recovery.h"
#include "slam/map_snapshot.h"
#include "slam/measurement_noise.h"
#include "slam/projection_matcher.h"

namespace posed {

/// Where a frame is in a piece of map, and what shows it.
struct PlaceMatch {
  Se3 T_map_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< as in PoseSolution
  int inliers = 0;
  std::vector<std::pair<std::uint16_t, LandmarkId>> matches;  ///< the inliers: keypoint, landmark; by ascending keypoint
  double covered = 0;                                         ///< share of an 8x6 grid of the image that inliers lie in
};

/// The geometric check of a loop candidate, and relocalisation: the pose by matching descriptors with the candidate keyframe alone
/// (`KeyframeRecovery`), then twice guided matching against all landmarks around it and the robust pose solver. Without depth in
/// the frame the first pose comes of P3P, and depth plays no part after. Deterministic. Reentrant: one object a thread (it keeps
/// its scratch memory).
class PlaceVerifier {
 public:
  PlaceVerifier(const PinholeCamera& camera, const TrackerConfig& config);

  /// `map`: the landmarks around `keyframe`, which is one of `map.keyframes`. Nothing where fewer than `min_inliers` landmarks
  /// agree on a pose.
  std::optional<PlaceMatch> verify(const MapSnapshot& map, const SnapshotKeyframe& keyframe, const FeatureFrame& frame,
                                   int min_inliers);

 private:
  PoseSolution refine(const MapSnapshot& map, const Se3& T_map_camera, const FeatureFrame& frame, float radius);
  double covered_share(const FeatureFrame& frame, const PlaceMatch& match) const;

  PinholeCamera camera_;
  MeasurementNoise noise_;
  KeyframeRecovery recovery_;
  ProjectionMatcher matcher_;
  std::vector<ProjectedLandmark> projected_;
  std::vector<std::int32_t> landmark_of_;  // by keypoint
  std::vector<std::uint16_t> keypoints_;   // of the observations
  std::vector<PoseObservation> observations_;
};

}  // namespace posed
