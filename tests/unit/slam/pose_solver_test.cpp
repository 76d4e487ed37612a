#include "slam/pose_solver.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

const CameraIntrinsics kIntrinsics;  // 525, 525, 319.5, 239.5 at 640x480, no distortion

/// A camera that looks at random points, each measured with unit-variance noise (or none).
struct Scene {
  PinholeCamera camera{kIntrinsics};
  Se3 T_map_camera = Se3::exp((Vector6d() << 0.2, -0.4, 0.1, 1.0, -2.0, 0.5).finished());
  std::vector<PoseObservation> observations;

  Scene(unsigned seed, int count, double pixel_sigma, double disparity_sigma) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> u(20, 620);
    std::uniform_real_distribution<double> v(20, 460);
    std::uniform_real_distribution<double> depth(0.8, 4.0);
    std::normal_distribution<double> normal;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d pixel(u(generator), v(generator));
      const double z = depth(generator);
      PoseObservation o;
      o.p_map = T_map_camera * camera.unproject(pixel, z);
      o.ideal_pixel = pixel + pixel_sigma * Eigen::Vector2d(normal(generator), normal(generator));
      o.disparity = disparity_sigma < 0 ? 0.0 : kIntrinsics.baseline_fx / z + disparity_sigma * normal(generator);
      o.pixel_weight = pixel_sigma > 0 ? 1.0 / (pixel_sigma * pixel_sigma) : 1.0;
      o.disparity_weight = disparity_sigma > 0 ? 1.0 / (disparity_sigma * disparity_sigma) : 1.0;
      observations.push_back(o);
    }
  }
};

Vector6d error_of(const Se3& truth, const Se3& estimate) {
  return (estimate.inverse() * truth).log();
}

const Vector6d kFarStart = (Vector6d() << 0.05, -0.05, 0.03, 0.05, 0.1, -0.08).finished();

TEST(PoseSolver, FindsTheExactPoseFromExactMeasurements) {
  for (const double disparity_sigma : {0.0, -1.0}) {  // with depth, and without
    Scene scene(1, 100, 0.0, disparity_sigma);
    const PoseSolution solution = solve_pose(scene.camera, scene.T_map_camera * Se3::exp(kFarStart), scene.observations);
    ASSERT_TRUE(solution.solved);
    EXPECT_EQ(solution.inliers, 100);
    EXPECT_LT(error_of(scene.T_map_camera, solution.T_map_camera).norm(), 1e-8);
  }
}

TEST(PoseSolver, RejectsOutliersAndSaysWhich) {
  Scene scene(2, 200, 0.5, 0.1);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> shift(20, 200);
  for (std::size_t i = 0; i < 80; ++i) {
    scene.observations[i].ideal_pixel += Eigen::Vector2d(shift(generator), -shift(generator));
  }
  const PoseSolution solution = solve_pose(scene.camera, scene.T_map_camera * Se3::exp(0.3 * kFarStart), scene.observations);
  ASSERT_TRUE(solution.solved);
  EXPECT_LT(error_of(scene.T_map_camera, solution.T_map_camera).norm(), 0.01);
  for (std::size_t i = 0; i < 80; ++i) {
    EXPECT_FALSE(scene.observations[i].inlier) << i;
  }
  EXPECT_GT(solution.inliers, 100);
}

TEST(PoseSolver, CovarianceMatchesTheScatterOfItsErrors) {
  // Over many scenes of the same statistics, the error weighted by the covariance is chi-squared with 6 degrees of freedom: mean 6.
  constexpr int kTrials = 400;
  double sum = 0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Scene scene(100 + seed, 60, 1.0, 0.3);
    const PoseSolution solution = solve_pose(scene.camera, scene.T_map_camera, scene.observations);
    ASSERT_TRUE(solution.solved);
    const Vector6d error = error_of(scene.T_map_camera, solution.T_map_camera);
    sum += error.dot(solution.covariance.ldlt().solve(error));
  }
  const double mean = sum / kTrials;
  EXPECT_NEAR(mean, 6.0, 0.6);  // the standard deviation of the mean is sqrt(12 / 400) = 0.17
}

TEST(PoseSolver, CovarianceIsRotationFirst) {
  // Far points fix the rotation well and the translation badly.
  Scene scene(5, 100, 1.0, -1.0);
  for (PoseObservation& o : scene.observations) {
    const Eigen::Vector3d p_camera = scene.T_map_camera.inverse() * o.p_map;
    o.p_map = scene.T_map_camera * Eigen::Vector3d(p_camera * 10.0);
  }
  const PoseSolution solution = solve_pose(scene.camera, scene.T_map_camera, scene.observations);
  ASSERT_TRUE(solution.solved);
  EXPECT_LT(solution.covariance.diagonal().head<3>().maxCoeff(), 1e-4);
  EXPECT_GT(solution.covariance.diagonal().tail<3>().minCoeff(), solution.covariance.diagonal().head<3>().maxCoeff());
}

TEST(PoseSolver, GivesNoPoseFromTooLittle) {
  Scene few(6, 4, 0.0, 0.0);
  EXPECT_FALSE(solve_pose(few.camera, few.T_map_camera, few.observations).solved);

  Scene none(6, 0, 0.0, 0.0);
  EXPECT_FALSE(solve_pose(none.camera, none.T_map_camera, none.observations).solved);

  Scene behind(7, 50, 0.0, 0.0);
  const Se3 turned = behind.T_map_camera * Se3::exp((Vector6d() << 0, 3.14159, 0, 0, 0, 0).finished());
  EXPECT_FALSE(solve_pose(behind.camera, turned, behind.observations).solved);
}

TEST(PoseSolver, GivesNoPoseFromOnePointSeenManyTimes) {
  Scene scene(8, 50, 0.0, -1.0);
  for (PoseObservation& o : scene.observations) {
    o = scene.observations.front();
  }
  EXPECT_FALSE(solve_pose(scene.camera, scene.T_map_camera, scene.observations).solved);
}

TEST(PoseSolver, IsDeterministic) {
  Scene a(9, 300, 1.0, 0.3);
  Scene b(9, 300, 1.0, 0.3);
  const Se3 start = a.T_map_camera * Se3::exp(kFarStart);
  const PoseSolution first = solve_pose(a.camera, start, a.observations);
  const PoseSolution second = solve_pose(b.camera, start, b.observations);
  EXPECT_EQ(first.T_map_camera.translation(), second.T_map_camera.translation());
  EXPECT_EQ(first.T_map_camera.rotation().coeffs(), second.T_map_camera.rotation().coeffs());
  EXPECT_EQ(first.covariance, second.covariance);
}

}  // namespace
}  // namespace posed
