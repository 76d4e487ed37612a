#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/landmark_estimator.h"
#include "slam/map.h"

namespace posed {

/// The point nearest to two viewing rays (the midpoint method: Hartley, Sturm, "Triangulation", CVIU 1997, section 5.3, with rays
/// of any number), or nothing where the rays are nearly parallel (`least_parallax_rad`) or meet behind a camera. Ideal pixels.
/// Reentrant.
std::optional<Eigen::Vector3d> triangulate(const PinholeCamera& camera, const Se3& T_map_a, const Eigen::Vector2d& pixel_a,
                                           const Se3& T_map_b, const Eigen::Vector2d& pixel_b, double least_parallax_rad);

/// Makes landmarks of keypoints that have no landmark and whose depth is missing or too large to be trusted alone: they are matched
/// along the epipolar line with such keypoints of a neighbour and triangulated. Keeps scratch memory. Thread-bound.
class LandmarkTriangulation {
 public:
  LandmarkTriangulation(const LandmarkEstimator& estimator, double close_depth_m)
      : estimator_(estimator), close_depth_m_(close_depth_m) {}

  /// The number of landmarks made.
  int triangulate_between(Map& map, KeyframeId keyframe, KeyframeId neighbour);

 private:
  struct Match {
    std::uint16_t neighbour_keypoint = 0;
    int distance = 0;
  };
  void collect_free(const Keyframe& keyframe, std::vector<std::uint16_t>& free) const;
  std::optional<Match> match_on_epipolar_line(const Keyframe& keyframe, std::uint16_t keypoint, const Keyframe& neighbour,
                                              const Eigen::Matrix3d& fundamental) const;
  bool make_landmark(Map& map, KeyframeId keyframe, std::uint16_t keypoint, KeyframeId neighbour, std::uint16_t neighbour_keypoint);

  const LandmarkEstimator& estimator_;
  double close_depth_m_;
  std::vector<std::uint16_t> free_;
  std::vector<std::uint16_t> neighbour_free_;
};

}  // namespace posed
