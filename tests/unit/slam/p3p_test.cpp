#include "slam/p3p.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(P3p, FindsThePoseAmongItsSolutions) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  int found = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector6d xi;
    for (double& x : xi) {
      x = 2 * unit(random);
    }
    const Se3 T_map_camera = Se3::exp(xi);
    std::array<Eigen::Vector3d, 3> p_map;
    std::array<Eigen::Vector3d, 3> ray;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d p_camera(2 * unit(random), 1.5 * unit(random), 3 + 2 * unit(random));
      p_map[i] = T_map_camera * p_camera;
      ray[i] = p_camera.normalized();
    }
    const P3pSolutions solutions = solve_p3p(p_map, ray);
    double nearest = 1e9;
    for (int s = 0; s < solutions.count; ++s) {
      const Se3& solution = solutions.T_map_camera[static_cast<std::size_t>(s)];
      nearest = std::min(nearest, (solution.inverse() * T_map_camera).log().norm());
      for (std::size_t i = 0; i < 3; ++i) {  // every solution sees every point along its ray
        EXPECT_LT((solution.inverse() * p_map[i]).normalized().cross(ray[i]).norm(), 1e-6) << trial;
      }
    }
    found += nearest < 1e-6 ? 1 : 0;
  }
  // Triangles that are nearly flat or seen nearly edge-on are lost to rounding.
  EXPECT_GT(found, kTrials * 995 / 1000);
}

TEST(P3p, PointsThatCoincideHaveNoSolution) {
  const std::array<Eigen::Vector3d, 3> p_map = {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 0, 2)};
  const std::array<Eigen::Vector3d, 3> ray = {p_map[0].normalized(), p_map[1].normalized(), p_map[2].normalized()};
  EXPECT_EQ(solve_p3p(p_map, ray).count, 0);
}

}  // namespace
}  // namespace posed
