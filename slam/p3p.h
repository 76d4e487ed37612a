#pragma once

#include <array>
#include <span>

#include "core/se3.h"

namespace posed {

struct P3pSolutions {
  std::array<Se3, 4> T_map_camera;
  int count = 0;
};

/// All poses from which three points are seen along three rays: at most four. `p_map` [m]; `ray_camera`: unit vectors. Points on
/// one line or rays that coincide give none, or poses that mean nothing; whoever samples checks them against other points. The
/// distances along the rays lie where two quadrics meet, and a degenerate member of their pencil, found by a cubic equation, splits
/// into two planes. Source: Persson, Nordberg, "Lambda Twist: an accurate fast robust perspective three point (P3P) solver", ECCV
/// 2018. Does not allocate. Reentrant.
P3pSolutions solve_p3p(std::span<const Eigen::Vector3d, 3> p_map, std::span<const Eigen::Vector3d, 3> ray_camera);

}  // namespace posed
