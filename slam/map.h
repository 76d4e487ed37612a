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

constexpr float kStaticPrior = 1.0F;  ///< log-odds of a new landmark: nearly three in four are what they seem

/// A point of the static world.
struct Landmark {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();          ///< [m]
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();    ///< inverse covariance of p_map, given the keyframes' poses [1 / m^2]
  Eigen::Vector3d mean_view_map = Eigen::Vector3d::Zero();  ///< unit vector, from the cameras to the landmark
  float max_distance_m = 0;                                 ///< as in SnapshotLandmark
  float min_distance_m = 0;
  Descriptor descriptor{};
  std::vector<Observation> observations;  ///< in the order they were made
  float static_log_odds = kStaticPrior;   ///< of being static, by Bayes' rule; not saved with the map
  std::uint32_t predicted = 0;            ///< keyframes that should have seen it
  std::uint32_t found = 0;                ///< keyframes that did

  /// The oldest keyframe that sees it: who moves, moves it along. There must be one.
  KeyframeId oldest_observer() const;

  /// Where the map around it is moved by T_new_old.
  void move(const Se3& T_new_old);
};

/// A place that was seen again: the pose of another keyframe relative to this one, measured by matching their features.
struct LoopConstraint {
  KeyframeId other = kNoKeyframe;
  Se3 T_this_other;
  Matrix6d information = Matrix6d::Identity();  ///< of xi in T_this_other * exp(xi)
};

/// A frame that the map keeps. Index i of the vectors is one keypoint.
struct Keyframe {
  std::uint32_t map_id = 0;  ///< keyframes of different maps have no common frame of reference, and share no landmark
  std::uint64_t sequence = 0;
  TimeNs capture_ns = 0;
  Se3 T_map_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< of T_map_camera against the map's first keyframe, as in PoseEstimate

  Features features;
  std::vector<Eigen::Vector2f> ideal_pixels;
  std::vector<float> depth_m;
  std::vector<LandmarkId> landmarks;  ///< or kNoLandmark

  std::map<KeyframeId, int> covisible;  ///< other keyframes: landmarks seen by both; kept by Map
  KeyframeId parent = kNoKeyframe;      ///< in the spanning tree; none: a root
  std::vector<LoopConstraint> loops;
};

/// Keyframes and landmarks of all maps, with the links between them; keeps the links consistent both ways. What it holds depends
/// on the calls alone, and so does every order it gives. Thread-bound to the mapper.
class Map {
 public:
  /// Takes a copy of the record's frame, without its landmark links: those come by `observe`.
  Keyframe& add_keyframe(const KeyframeRecord& record);

  /// Takes a keyframe as it was saved, links included, once all of its landmarks are there.
  void restore_keyframe(KeyframeId id, Keyframe keyframe);

  LandmarkId add_landmark(Landmark landmark);

  /// A landmark as it was saved, without observations: those come with its keyframes.
  void restore_landmark(LandmarkId id, Landmark landmark);

  /// The next landmark gets this identifier or a higher one: identifiers go on from where the saved map stood.
  void restore_next_landmark(LandmarkId next);

  /// Links a landmark to a keypoint that has none, of a keyframe that does not see it yet.
  void observe(LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint);

  /// Takes one observation away, and the landmark with it where it was the last.
  void forget_observation(LandmarkId landmark, KeyframeId keyframe);

  /// Gives `duplicate`'s observations to `kept` and removes it.
  void merge_landmarks(LandmarkId duplicate, LandmarkId kept);

  void remove_landmark(LandmarkId landmark);

  /// Also removes the landmarks that nobody else observes; its children in the spanning tree go to its parent, and those of a root
  /// to the oldest of them.
  void remove_keyframe(KeyframeId keyframe);

  /// Moves everything of map `from` by T_to_from and makes it part of map `to`.
  void join(std::uint32_t from, std::uint32_t to, const Se3& T_to_from);

  Landmark* find_landmark(LandmarkId id);
  const Landmark* find_landmark(LandmarkId id) const;
  Keyframe* find_keyframe(KeyframeId id);
  const Keyframe* find_keyframe(KeyframeId id) const;

  /// Whether any keyframe belongs to it.
  bool has_map(std::uint32_t map_id) const;

  /// Index of the keypoint by which `keyframe` sees the landmark, or -1.
  static int keypoint_of(const Landmark& landmark, KeyframeId keyframe);

  /// The keyframes that share at least `least` landmarks with this one, most first, at most `count`.
  std::vector<KeyframeId> covisible_keyframes(KeyframeId keyframe, int least, std::size_t count) const;

  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  std::vector<LandmarkId> landmark_ids() const;  ///< ascending
  std::size_t landmark_count() const { return landmarks_.size(); }
  LandmarkId next_landmark() const { return next_landmark_; }

 private:
  void change_covisibility(const Landmark& landmark, KeyframeId keyframe, int change);

  std::map<KeyframeId, Keyframe> keyframes_;  // ordered: the newest is the last
  std::unordered_map<LandmarkId, Landmark> landmarks_;
  LandmarkId next_landmark_ = 1;
};

}  // namespace posed
