#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "slam/block_cholesky.h"
#include "slam/bundle_problem.h"

namespace posed {

/// An observation that takes part in a round of bundle adjustment.
struct ActiveObservation {
  Eigen::Vector2d ideal_pixel;
  double disparity;
  double pixel_weight;
  double disparity_weight;
  std::uint32_t camera;  ///< index into the problem's cameras
  std::int32_t unknown;  ///< its camera's place among the unknown poses; kFixedCamera where it has none
};

/// Who sees whom in one round of bundle adjustment: the active observations grouped by point, the unknown poses in the order in
/// which they are to be eliminated (approximate minimum degree: Amestoy, Davis, Duff, 1996), and the pattern of the reduced camera
/// system. Keeps its memory. Thread-bound.
class BundleStructure {
 public:
  static constexpr std::int32_t kFixedCamera = -1;

  /// Takes the problem's inliers. An observation that says nothing about anything, because its point was seen once and without
  /// depth, is left out.
  void build(const BundleProblem& problem);

  std::size_t points() const { return point_offsets_.size() - 1; }
  const std::vector<ActiveObservation>& observations() const { return observations_; }
  /// Of each point's first observation in `observations()`, and the end.
  const std::vector<std::uint32_t>& point_offsets() const { return point_offsets_; }
  /// Index of each unknown pose into the problem's cameras.
  const std::vector<std::uint32_t>& unknowns() const { return unknowns_; }
  const BlockPattern& pattern() const { return pattern_; }

  /// One observation of an unknown camera.
  struct CameraEntry {
    std::uint32_t observation, point;
  };
  /// Of each unknown's first entry in `camera_entries()`, and the end.
  const std::vector<std::uint32_t>& camera_offsets() const { return camera_offsets_; }
  const std::vector<CameraEntry>& camera_entries() const { return camera_entries_; }

 private:
  void group_by_point(const BundleProblem& problem);
  void number_cameras(const BundleProblem& problem);
  void group_by_camera();
  void find_pattern();
  void order_for_elimination();

  std::vector<ActiveObservation> observations_;
  std::vector<std::uint32_t> point_offsets_ = {0};
  std::vector<std::uint32_t> unknowns_;
  std::vector<std::uint32_t> camera_offsets_;
  std::vector<CameraEntry> camera_entries_;
  BlockPattern pattern_;
  std::vector<std::int32_t> unknown_of_camera_;  // scratch
  std::vector<std::uint32_t> cursor_;            // scratch
};

}  // namespace posed
