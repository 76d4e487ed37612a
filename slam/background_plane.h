#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace posed {

/// The points p of the camera frame with normal . p = distance_m, normal of length 1 [m].
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float distance_m = 0;

  /// Whether a point lies on it, but for what the sensor's noise and a slanted surface within a cell of the depth grid may add.
  bool holds(const Eigen::Vector3f& p_camera) const {
    const float tolerance_m = 0.008F + 0.006F * p_camera.z() * p_camera.z();
    return std::abs(normal.dot(p_camera) - distance_m) < tolerance_m;
  }
};

/// The plane that holds most of the points, by RANSAC (Fischler and Bolles, 1981) and a fit to the points that it holds; none
/// where that is less than `least_share` of them. The same points in the same order give the same plane. Reentrant; does not
/// allocate.
std::optional<Plane> find_plane(std::span<const Eigen::Vector3f> points, float least_share);

}  // namespace posed
