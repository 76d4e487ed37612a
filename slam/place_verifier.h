#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "config/config.h"
#include "slam/feature_frame.h"
#include "slam/frame_localizer.h"
#include "slam/keyframe_recovery.h"
#include "slam/map_snapshot.h"

namespace posed {

/// A frame's place among a map's landmarks.
struct PlaceMatch {
  Se3 T_map_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< as in PoseSolution
  int inliers = 0;
  std::vector<std::pair<std::uint16_t, LandmarkId>> matches;  ///< inliers: keypoint of the frame, landmark
  double covered = 0;                                         ///< share of the image's 8 x 6 cells that inliers lie in
};

/// Confirms by geometry that a frame was taken near a keyframe: descriptors are matched with the keyframe's landmarks and a pose is
/// found by RANSAC (KeyframeRecovery); then the landmarks of its surroundings are searched where that pose puts them. One object a
/// thread.
class PlaceVerifier {
 public:
  PlaceVerifier(const PinholeCamera& camera, const TrackerConfig& config);

  /// `around`: the surroundings of `candidate`, which is one of its keyframes. Nothing where fewer than `min_inliers` agree.
  std::optional<PlaceMatch> verify(const MapSnapshot& around, const SnapshotKeyframe& candidate, const FeatureFrame& frame,
                                   int min_inliers);

 private:
  CameraIntrinsics intrinsics_;
  KeyframeRecovery recovery_;
  FrameLocalizer localizer_;
};

}  // namespace posed
