#include "slam/bundle_adjuster.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/bundle_scene.h"
#include "tests/support/ceres_bundle.h"

namespace posed {
namespace {

const PinholeCamera kCamera{CameraIntrinsics{}};
const BundleOptions kExact{.max_iterations = 50, .rounds = 2, .cost_tolerance = 1e-14};

double pose_distance(const Se3& a, const Se3& b) {
  return (a.inverse() * b).log().norm();
}

bool same_bits(const Se3& a, const Se3& b) {
  return a.rotation().coeffs() == b.rotation().coeffs() && a.translation() == b.translation();
}

bool same_bits(const BundleProblem& a, const BundleProblem& b) {
  return std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(),
                    [](const BundleCamera& x, const BundleCamera& y) { return same_bits(x.T_map_camera, y.T_map_camera); }) &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
                    [](const BundlePoint& x, const BundlePoint& y) { return x.p_map == y.p_map; }) &&
         std::equal(a.observations.begin(), a.observations.end(), b.observations.begin(), b.observations.end(),
                    [](const BundleObservation& x, const BundleObservation& y) { return x.inlier == y.inlier; });
}

bool is_finite(const BundleProblem& problem) {
  return std::all_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const BundleCamera& c) { return c.T_map_camera.is_finite(); }) &&
         std::all_of(problem.points.begin(), problem.points.end(), [](const BundlePoint& p) { return p.p_map.allFinite(); });
}

double worst_pose_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    worst = std::max(worst, pose_distance(a.cameras[c].T_map_camera, b.cameras[c].T_map_camera));
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

double pose_rms(const BundleProblem& a, const BundleProblem& b) {
  double sum = 0;
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    sum += std::pow(pose_distance(a.cameras[c].T_map_camera, b.cameras[c].T_map_camera), 2);
  }
  return std::sqrt(sum / static_cast<double>(a.cameras.size()));
}

/// One camera at the origin, fixed, and one point straight ahead of it.
BundleProblem one_sighting(double depth_m) {
  BundleProblem problem;
  problem.cameras.push_back({Se3(), true});
  problem.points.push_back({Eigen::Vector3d(0.1, 0.2, depth_m)});
  BundleObservation o;
  o.ideal_pixel = {320, 240};
  o.disparity = kCamera.intrinsics().baseline_fx / 2.0;
  problem.observations.push_back(o);
  return problem;
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

TEST(BundleAdjuster, NeedsNoDepthWhereTwoFixedCamerasGiveTheScale) {
  BundleScene scene = make_bundle_scene(kCamera, {.fixed_cameras = 2, .pixel_sigma = 0, .depth_share = 0});
  const BundleSummary summary = BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_EQ(summary.outcome, BundleOutcome::Converged);
  EXPECT_LT(worst_pose_error(scene.truth, scene.problem), 1e-6);
}

TEST(BundleAdjuster, ErrorsAreThoseOfTheMeasurements) {
  BundleScene scene = make_bundle_scene(kCamera, {.cameras = 12, .points = 800, .rounds = 0.1});
  const BundleSummary summary = BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_EQ(summary.outcome, BundleOutcome::Converged);
  // Measurements of one pixel and 0.3 pixels of disparity: the chi-squared of all of them (Huber's kernel takes a little away) is
  // about their number less that of the unknowns.
  double residuals = 0;
  for (const BundleObservation& o : scene.problem.observations) {
    residuals += o.disparity > 0 ? 3 : 2;
  }
  const double freedom = residuals - 3.0 * static_cast<double>(scene.problem.points.size()) - 6.0 * 11;
  EXPECT_NEAR(summary.final_cost / freedom, 1.0, 0.05);
  EXPECT_LT(pose_rms(scene.truth, scene.problem), 0.005);  // it starts at 0.05
}

TEST(BundleAdjuster, TellsOutliersFromInliers) {
  BundleScene scene = make_bundle_scene(kCamera, {.cameras = 12, .points = 800, .rounds = 0.1, .outlier_share = 0.1});
  BundleAdjuster(kCamera).solve(scene.problem, {.max_iterations = 20});
  int outliers = 0;
  int missed = 0;
  int inliers = 0;
  int condemned = 0;
  for (std::size_t n = 0; n < scene.is_outlier.size(); ++n) {
    const bool inlier = scene.problem.observations[n].inlier;
    ++(scene.is_outlier[n] ? outliers : inliers);
    missed += scene.is_outlier[n] && inlier ? 1 : 0;
    condemned += !scene.is_outlier[n] && !inlier ? 1 : 0;
  }
  EXPECT_GT(outliers, 300);
  EXPECT_LT(missed, 0.02 * outliers);
  EXPECT_LT(condemned, 0.10 * inliers);  // 5 % of good measurements lie beyond a 95 % bound
  EXPECT_LT(pose_rms(scene.truth, scene.problem), 0.005);
}

TEST(BundleAdjuster, FindsTheMinimumThatCeresFinds) {
  for (const double depth_share : {0.0, 0.5}) {
    BundleScene scene = make_bundle_scene(
        kCamera, {.cameras = 15, .fixed_cameras = 3, .points = 500, .depth_share = depth_share, .outlier_share = 0.05});
    BundleProblem reference = scene.problem;
    const BundleSummary summary = BundleAdjuster(kCamera).solve(scene.problem, kExact);
    solve_bundle_with_ceres(kCamera, reference, kExact, CeresSchur::Sparse);
    EXPECT_EQ(summary.outcome, BundleOutcome::Converged);
    EXPECT_LT(worst_pose_error(reference, scene.problem), 1e-6);
    // Where one observation without depth is all that is left of a point, Ceres moves the point onto it and we leave it alone.
    std::vector<int> residuals(reference.points.size(), 0);
    for (const BundleObservation& o : scene.problem.observations) {
      residuals[o.point] += !o.inlier ? 0 : o.disparity > 0 ? 3 : 2;
    }
    int compared = 0;
    for (std::size_t n = 0; n < reference.observations.size(); ++n) {
      if (residuals[reference.observations[n].point] >= 3) {
        EXPECT_EQ(reference.observations[n].inlier, scene.problem.observations[n].inlier) << n;
        ++compared;
      }
    }
    EXPECT_GT(compared, 1000);
  }
}

TEST(BundleAdjuster, SolvesASparseLoop) {
  // Poses far apart share no points, so the reduced system has holes and the order of elimination matters.
  BundleScene scene = make_bundle_scene(
      kCamera, {.cameras = 60, .points = 1500, .rounds = 1.5, .pixel_sigma = 0, .disparity_sigma = 0, .pose_error = 0.01});
  BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_LT(worst_pose_error(scene.truth, scene.problem), 1e-7);
}

TEST(BundleAdjuster, FixedCamerasStay) {
  BundleScene scene = make_bundle_scene(kCamera, {.cameras = 8, .fixed_cameras = 3});
  const BundleProblem before = scene.problem;
  BundleAdjuster(kCamera).solve(scene.problem, {});
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_TRUE(same_bits(before.cameras[c].T_map_camera, scene.problem.cameras[c].T_map_camera)) << c;
  }
  EXPECT_FALSE(same_bits(before.cameras[3].T_map_camera, scene.problem.cameras[3].T_map_camera));
}

TEST(BundleAdjuster, HoldsTheFirstCameraWhereNoneIsFixed) {
  BundleScene scene = make_bundle_scene(kCamera, {.fixed_cameras = 0, .pixel_sigma = 0, .disparity_sigma = 0});
  const Se3 first = scene.problem.cameras[0].T_map_camera;
  BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_TRUE(same_bits(first, scene.problem.cameras[0].T_map_camera));
  const Se3 T_truth_map = scene.truth.cameras[0].T_map_camera * first.inverse();
  for (std::size_t c = 1; c < scene.problem.cameras.size(); ++c) {
    EXPECT_LT(pose_distance(scene.truth.cameras[c].T_map_camera, T_truth_map * scene.problem.cameras[c].T_map_camera), 1e-8) << c;
  }
}

TEST(BundleAdjuster, WhatNothingDeterminesStays) {
  BundleScene scene = make_bundle_scene(kCamera, {.points = 200});
  BundleProblem& problem = scene.problem;
  const auto unseen_camera = static_cast<std::uint32_t>(problem.cameras.size());
  problem.cameras.push_back({Se3::exp(Vector6d::Constant(0.1)), false});
  const auto unseen = static_cast<std::uint32_t>(problem.points.size());
  problem.points.push_back({Eigen::Vector3d(1, 2, 3)});
  const std::uint32_t seen_once = unseen + 1;
  problem.points.push_back({problem.cameras[4].T_map_camera * Eigen::Vector3d(0.1, 0, 2)});
  BundleObservation once;
  once.camera = 4;
  once.point = seen_once;
  once.ideal_pixel = {300, 200};
  problem.observations.push_back(once);
  const std::uint32_t disowned = 17;  // all its observations are outliers from the start
  for (BundleObservation& o : problem.observations) {
    o.inlier = o.point != disowned;
  }
  const BundleProblem before = problem;
  BundleAdjuster(kCamera).solve(problem, {});
  EXPECT_TRUE(same_bits(before.cameras[unseen_camera].T_map_camera, problem.cameras[unseen_camera].T_map_camera));
  for (const std::uint32_t p : {unseen, seen_once, disowned}) {
    EXPECT_EQ(before.points[p].p_map, problem.points[p].p_map) << p;
  }
  EXPECT_NE(before.points[0].p_map, problem.points[0].p_map);
}

TEST(BundleAdjuster, PointsBehindTheirCamerasStayAndAreOutliers) {
  BundleScene scene = make_bundle_scene(kCamera, {.points = 200, .pixel_sigma = 0, .disparity_sigma = 0, .pose_error = 0});
  BundleProblem& problem = scene.problem;
  problem.points[5].p_map = Eigen::Vector3d::Zero();  // all look away from the origin
  BundleAdjuster(kCamera).solve(problem, kExact);
  EXPECT_EQ(problem.points[5].p_map, Eigen::Vector3d::Zero());
  for (const BundleObservation& o : problem.observations) {
    EXPECT_EQ(o.inlier, o.point != 5);
  }
  EXPECT_LT(worst_pose_error(scene.truth, problem), 1e-7);
}

TEST(BundleAdjuster, SaysWhereThereIsNothingToAdjust) {
  BundleAdjuster adjuster(kCamera);
  BundleProblem empty;
  EXPECT_EQ(adjuster.solve(empty, {}).outcome, BundleOutcome::Degenerate);

  BundleScene scene = make_bundle_scene(kCamera, {.points = 50});
  scene.problem.observations.clear();
  const BundleProblem before = scene.problem;
  EXPECT_EQ(adjuster.solve(scene.problem, {}).outcome, BundleOutcome::Degenerate);
  EXPECT_TRUE(same_bits(before, scene.problem));
}

TEST(BundleAdjuster, OnePointOfOneFixedCameraGoesWhereItWasMeasured) {
  BundleProblem problem = one_sighting(1.5);
  const BundleSummary summary = BundleAdjuster(kCamera).solve(problem, kExact);
  EXPECT_EQ(summary.outcome, BundleOutcome::Converged);
  EXPECT_LT((problem.points[0].p_map - kCamera.unproject({320, 240}, 2.0)).norm(), 1e-9);
  EXPECT_TRUE(problem.observations[0].inlier);
}

TEST(BundleAdjuster, WhatIsNotANumberDoesNotSpread) {
  BundleScene scene = make_bundle_scene(kCamera, {.points = 200, .pixel_sigma = 0, .disparity_sigma = 0});
  scene.problem.points[3].p_map.x() = std::numeric_limits<double>::quiet_NaN();
  BundleAdjuster(kCamera).solve(scene.problem, kExact);
  EXPECT_LT(worst_pose_error(scene.truth, scene.problem), 1e-7);
  scene.problem.points[3].p_map.x() = 0;
  EXPECT_TRUE(is_finite(scene.problem));
}

TEST(BundleAdjuster, AnInterruptAtAnyMomentLeavesAProblemThatIsNoWorse) {
  const BundleScene scene = make_bundle_scene(kCamera, {.cameras = 6, .fixed_cameras = 2, .points = 120, .outlier_share = 0.05});
  BundleAdjuster adjuster(kCamera);
  int asked = 0;
  BundleProblem whole = scene.problem;
  const BundleSummary uninterrupted = adjuster.solve(whole, {}, [&asked] { return ++asked < 0; });
  ASSERT_GT(asked, 50);
  double last_cost = std::numeric_limits<double>::infinity();
  for (int moment = 0; moment < asked; ++moment) {
    BundleProblem problem = scene.problem;
    int left = moment;
    const BundleSummary summary = adjuster.solve(problem, {}, [&left] { return left-- == 0; });
    ASSERT_EQ(summary.outcome, BundleOutcome::Interrupted) << moment;
    ASSERT_EQ(left, -1) << moment << ": asked again after the answer";
    ASSERT_TRUE(is_finite(problem)) << moment;
    ASSERT_LE(summary.final_cost, summary.initial_cost) << moment;
    if (moment == 0) {
      EXPECT_EQ(summary.final_cost, summary.initial_cost);
    }
    last_cost = summary.final_cost;
  }
  EXPECT_LT(last_cost, 0.5 * uninterrupted.initial_cost);
}

TEST(BundleAdjuster, GivesTheSameBitsWhateverItDidBefore) {
  const BundleScene scene = make_bundle_scene(kCamera, {.cameras = 20, .points = 300, .rounds = 1.2, .outlier_share = 0.05});
  BundleAdjuster used(kCamera);
  BundleScene other = make_bundle_scene(kCamera, {.cameras = 30, .points = 900, .seed = 2});
  used.solve(other.problem, {});
  BundleProblem first = scene.problem;
  BundleProblem second = scene.problem;
  used.solve(first, {});
  BundleAdjuster(kCamera).solve(second, {});
  EXPECT_TRUE(same_bits(first, second));
  EXPECT_FALSE(same_bits(first, scene.problem));
}

}  // namespace
}  // namespace posed
