#include "core/rigid_alignment.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

std::vector<Eigen::Vector3d> random_points(unsigned seed, int count) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(normal(generator), normal(generator), normal(generator));
  }
  return points;
}

TEST(RigidAlignment, FindsTheTransformThatMovedThePoints) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const std::vector<Eigen::Vector3d> p_b = random_points(seed, 3 + static_cast<int>(seed));
    const Se3 T_a_b = Se3::exp(Vector6d(3.0 * Vector6d::Constant(std::sin(seed))));
    std::vector<Eigen::Vector3d> p_a;
    for (const Eigen::Vector3d& p : p_b) {
      p_a.push_back(T_a_b * p);
    }
    EXPECT_LT((align_points(p_a, p_b).inverse() * T_a_b).log().norm(), 1e-9) << seed;
  }
}

TEST(RigidAlignment, NeverMirrors) {
  const std::vector<Eigen::Vector3d> p_b = random_points(1, 20);
  std::vector<Eigen::Vector3d> p_a = p_b;
  for (Eigen::Vector3d& p : p_a) {
    p.x() = -p.x();
  }
  EXPECT_NEAR(align_points(p_a, p_b).rotation_matrix().determinant(), 1.0, 1e-12);
}

TEST(RigidAlignment, AveragesNoiseAway) {
  const std::vector<Eigen::Vector3d> p_b = random_points(2, 1000);
  const std::vector<Eigen::Vector3d> noise = random_points(3, 1000);
  std::vector<Eigen::Vector3d> p_a = p_b;
  for (std::size_t i = 0; i < p_a.size(); ++i) {
    p_a[i] += 0.01 * noise[i];
  }
  EXPECT_LT(align_points(p_a, p_b).log().norm(), 0.003);
}

}  // namespace
}  // namespace posed
