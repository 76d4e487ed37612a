#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/clock.h"
#include "core/se3.h"
#include "slam/features.h"

namespace posed {

using LandmarkId = std::uint64_t;
using KeyframeId = std::uint64_t;
constexpr LandmarkId kNoLandmark = 0;  ///< identifiers start at 1
constexpr KeyframeId kNoKeyframe = 0;

/// What the tracker asks of the mapper with a record.
enum class RecordPurpose : std::uint8_t {
  Keyframe,        ///< take it into the map
  Relocalization,  ///< find where it was taken; it has neither id nor pose
};

/// A frame as the tracker hands it to the mapper: its features, where they lie in space, and which landmarks they were matched to.
/// Index i of every vector is one keypoint. The vectors keep their capacity when a record is reused.
struct KeyframeRecord {
  RecordPurpose purpose = RecordPurpose::Keyframe;
  KeyframeId id = kNoKeyframe;  ///< given by the tracker, counting from 1
  std::uint64_t sequence = 0;   ///< of the frame
  TimeNs capture_ns = 0;
  Se3 T_map_camera;
  Se3 T_map_odom;                          ///< that T_map_camera rests on: the mapper may have corrected the map since
  Matrix6d covariance = Matrix6d::Zero();  ///< of T_map_camera, given the landmarks it was tracked against
  bool starts_map = false;                 ///< first keyframe of a new map: what came before is unrelated to it
  std::uint32_t map_id = 0;

  Features features;
  std::vector<Eigen::Vector2f> ideal_pixels;  ///< undistorted keypoints
  std::vector<float> depth_m;                 ///< 0 where the sensor saw none
  std::vector<LandmarkId> landmarks;          ///< matched landmark, or kNoLandmark
  bool shows_movers = false;  ///< or what was taken for them: who else moved there may have been missed
  /// Landmarks that the frame's depth speaks of though no keypoint matches them, both ascending:
  std::vector<LandmarkId> hidden;   ///< something is in front of them, so that they were not found says nothing
  std::vector<LandmarkId> refuted;  ///< the camera sees right through their place, or a mover is there: they are gone

  /// Makes room for `capacity` keypoints and `local_landmarks` of the map, so that filling the record does not allocate.
  void reserve(std::size_t capacity, std::size_t local_landmarks) {
    hidden.reserve(local_landmarks);
    refuted.reserve(local_landmarks);
    features.reserve(capacity);
    ideal_pixels.reserve(capacity);
    depth_m.reserve(capacity);
    landmarks.reserve(capacity);
  }
};

}  // namespace posed
