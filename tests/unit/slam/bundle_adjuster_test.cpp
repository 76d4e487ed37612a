#include "slam/bundle_adjuster.h"

#include <gtest/gtest.h>

#include "tests/support/bundle_scene.h"

namespace posed {
namespace {

const PinholeCamera kCamera{CameraIntrinsics{}};
const BundleOptions kExact{.max_iterations = 50, .rounds = 2, .cost_tolerance = 1e-14};

double worst_pose_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    worst = std::max(worst, (a.cameras[c].T_map_camera.inverse() * b.cameras[c].T_map_camera).log().norm());
  }
  return worst;
}

double worst_point_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t p = 0; p < a.points.size(); ++p) {
    worst = std::max(worst, (a.points[p].p_map - b.points[p].p_map).norm());
  }
  return worst;
}

TEST(BundleAdjuster, FindsTheExactSceneFromExactMeasurements) {
  BundleScene scene = make_bundle_scene(kCamera, {.pixel_sigma = 0, .disparity_sigma = 0});
  const BundleSummary summary = BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_EQ(summary.outcome, BundleOutcome::Converged);
  EXPECT_GT(summary.initial_cost, 1000.0);
  EXPECT_LT(summary.final_cost, 1e-12);
  EXPECT_LT(worst_pose_error(scene.truth, scene.problem), 1e-8);
  EXPECT_LT(worst_point_error(scene.truth, scene.problem), 1e-8);
}

}  // namespace
}  // namespace posed
