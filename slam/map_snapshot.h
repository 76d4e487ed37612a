#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/se3.h"
#include "slam/features.h"
#include "slam/keyframe_record.h"

namespace posed {

/// A landmark as the tracker needs it to predict where, how large and from which side it is seen.
struct SnapshotLandmark {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3f p_map = Eigen::Vector3f::Zero();          ///< [m]
  Eigen::Vector3f mean_view_map = Eigen::Vector3f::Zero();  ///< unit vector from the observing cameras to the landmark, averaged
  float max_distance_m = 0;  ///< from here the pyramid's first level (0) shows it at the scale it was described at
  float min_distance_m = 0;  ///< from here the last level does
  Descriptor descriptor{};
  std::uint32_t anchor = 0;  ///< index into MapSnapshot::anchors
};

/// The first keyframe that saw a landmark, whose error the landmark has.
struct SnapshotAnchor {
  Se3 T_map_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< against the map's origin, as in PoseEstimate
};

/// A recent keyframe, to recover from loss by matching against it.
struct SnapshotKeyframe {
  KeyframeId id = kNoKeyframe;
  Se3 T_map_camera;
  std::vector<std::uint32_t> landmarks;  ///< indices into MapSnapshot::landmarks that this keyframe observes
};

/// The mapper's answer to the tracker's last question where the camera is.
struct RelocalizationAnswer {
  std::uint64_t sequence = 0;  ///< of the frame that was asked about
  bool answered = false;       ///< false: nothing was asked yet
  bool found = false;          ///< then the snapshot shows the place that was found
  Se3 T_map_camera;            ///< of that frame
};

/// The tracker's view of the map: the landmarks around the camera and the keyframes that see them. Written by the mapper into a
/// `LatestValue`, immutable while the tracker reads it.
struct MapSnapshot {
  std::uint64_t version = 0;  ///< counts up with each snapshot; 0: nothing mapped yet
  std::uint32_t map_id = 0;
  std::uint32_t newest_map_id = 0;  ///< the largest that was ever given
  /// The mapper moves it with the part of the map that the camera is in, so that T_odom_camera, and with it the prediction of the
  /// next pose, stays continuous when the map is corrected.
  Se3 T_map_odom;
  KeyframeId newest_keyframe = kNoKeyframe;  ///< the last one the mapper has taken in
  RelocalizationAnswer relocalization;
  std::vector<SnapshotLandmark> landmarks;  ///< by ascending id
  std::vector<SnapshotAnchor> anchors;      ///< of those landmarks
  std::vector<SnapshotKeyframe> keyframes;  ///< the one this is the surroundings of, then those nearest to it
};

}  // namespace posed
