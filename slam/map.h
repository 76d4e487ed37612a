#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "slam/keyframe_record.h"

namespace posed {

struct Observation {
  KeyframeId keyframe = kNoKeyframe;
  std::uint16_t keypoint = 0;  ///< index into the keyframe's features
};

/// A point of the static world.
struct Landmark {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();          ///< [m]
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();    ///< inverse covariance of p_map, given the keyframes' poses [1 / m^2]
  Eigen::Vector3d mean_view_map = Eigen::Vector3d::Zero();  ///< unit vector, from the cameras to the landmark
  float max_distance_m = 0;                                 ///< as in SnapshotLandmark
  float min_distance_m = 0;
  Descriptor descriptor{};
  std::vector<Observation> observations;  ///< by ascending keyframe
  std::uint32_t predicted = 0;            ///< keyframes that should have seen it
  std::uint32_t found = 0;                ///< keyframes that did
};

/// A frame that the map keeps. Index i of the vectors is one keypoint.
struct Keyframe {
  Se3 T_map_camera;
  Features features;
  std::vector<Eigen::Vector2f> ideal_pixels;
  std::vector<float> depth_m;
  std::vector<LandmarkId> landmarks;  ///< or kNoLandmark
};

/// Keyframes and landmarks with the links between them; keeps the links consistent both ways. Thread-bound to the mapper.
class Map {
 public:
  /// Takes a copy of the record's frame, without its landmark links: those come by `observe`.
  Keyframe& add_keyframe(const KeyframeRecord& record);

  LandmarkId add_landmark(Landmark landmark);

  /// Links a landmark to a keypoint that has none.
  void observe(LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint);

  void remove_landmark(LandmarkId landmark);

  /// Also removes the landmarks that nobody else observes.
  void remove_keyframe(KeyframeId keyframe);

  void clear();

  Landmark* find_landmark(LandmarkId id);
  const Landmark* find_landmark(LandmarkId id) const;
  const Keyframe* find_keyframe(KeyframeId id) const;

  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  std::size_t landmark_count() const { return landmarks_.size(); }

 private:
  std::map<KeyframeId, Keyframe> keyframes_;  // ordered: the newest is the last
  std::unordered_map<LandmarkId, Landmark> landmarks_;
  LandmarkId next_landmark_ = 1;
};

}  // namespace posed
