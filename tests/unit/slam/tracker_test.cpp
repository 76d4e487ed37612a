#include "slam/tracker.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "slam/drift_model.h"
#include "tests/support/slam_rig.h"

namespace posed {
namespace {

TEST(Tracker, FollowsTheCameraThroughTheRoom) {
  SlamRig rig;
  double squared = 0;
  constexpr std::uint64_t kFrames = 90;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const PoseEstimate estimate = rig.track(i);
    ASSERT_TRUE(estimate.has_pose()) << "frame " << i << ": " << to_string(estimate.state);
    squared += std::pow(rig.error_m(i, estimate), 2);
    ASSERT_NE(estimate.reference_keyframe, kNoKeyframe);
    const Se3 rebuilt = *rig.mapper().keyframe_pose(estimate.reference_keyframe) * estimate.T_reference_camera;
    EXPECT_LT((rebuilt.inverse() * estimate.T_map_camera()).log().norm(), 0.02) << "but for what the map was adjusted since";
  }
  EXPECT_LT(std::sqrt(squared / kFrames), 0.03);
  EXPECT_GT(rig.mapper().keyframe_count(), 1U);
}

// Depth images a whole frame older than the colour images they come with, as of two cameras out of step, at the worst.
TEST(Tracker, DepthOfAnotherTimeIsMovedToTheColourImages) {
  constexpr TimeNs kFrame_ns = kNsPerSecond / 30;
  struct Case {
    TimeNs stamped_ns;     // what the stamps say
    double depth_delay_s;  // what the calibration adds
  };
  std::vector<double> rmse;
  std::vector<double> variance;
  for (const Case& given : {Case{0, 0}, Case{-kFrame_ns, 0}, Case{0, -1.0 / 30}}) {
    Config config = rig_config();
    config.intrinsics.depth_delay_s = given.depth_delay_s;
    SlamRig rig(config);
    ASSERT_NEAR(config.source.synthetic.rate_hz, 30.0, 1e-9);
    std::vector<float> before;
    const auto older_depth = [&](RgbdFrame& frame) {
      std::vector<float> now;
      for (int y = 0; y < frame.depth_m.height; ++y) {
        now.insert(now.end(), frame.depth_m.row(y), frame.depth_m.row(y) + frame.depth_m.width);
      }
      for (int y = 0; !before.empty() && y < frame.depth_m.height; ++y) {
        std::copy_n(before.begin() + y * frame.depth_m.width, frame.depth_m.width, frame.depth_m.row(y));
      }
      before = std::move(now);
      frame.depth_offset_ns = given.stamped_ns;
    };
    double squared = 0;
    double variances = 0;
    constexpr std::uint64_t kFrames = 90;
    for (std::uint64_t i = 0; i < kFrames; ++i) {
      // To and fro, since a delay that never changes its direction is hard to tell from another place.
      const auto index = static_cast<std::uint64_t>(std::lround(40 * (1 - std::cos(0.05 * M_PI * static_cast<double>(i)))));
      const PoseEstimate estimate = rig.track(index, older_depth);
      ASSERT_TRUE(estimate.has_pose()) << i;
      squared += std::pow(rig.error_m(index, estimate), 2);
      variances += estimate.residual_variance;
    }
    rmse.push_back(std::sqrt(squared / kFrames));
    variance.push_back(variances / kFrames);
  }
  EXPECT_LT(rmse[1], 0.5 * rmse[0]);
  EXPECT_LT(variance[1], 0.8 * variance[0]) << "by which a delay that no stamp tells is found";
  EXPECT_NEAR(rmse[2], rmse[1], 1e-6) << "stamps and calibration say it alike";
}

TEST(Tracker, StartsAtTheConfiguredPoseAndSaysHowSureItIs) {
  SlamRig rig;
  const PoseEstimate first = rig.track(0);
  EXPECT_TRUE(first.keyframe);
  EXPECT_EQ(first.T_map_camera().translation(), Eigen::Vector3d::Zero());
  EXPECT_EQ(first.covariance, start_covariance()) << "the first frame defines the map, as well as it measures";
  const PoseEstimate second = rig.track(1);
  ASSERT_TRUE(second.has_pose());
  EXPECT_GT(second.covariance.diagonal().minCoeff(), 0.0);
  EXPECT_LT(second.covariance.diagonal().maxCoeff(), 1e-2);
  EXPECT_LT((second.covariance - second.covariance.transpose()).cwiseAbs().maxCoeff(), 1e-12);
}

// One run is one draw of a slowly varying error, so this holds the order of magnitude; consistency_bench asks many runs.
TEST(Tracker, ItsErrorsAreWhatItsCovarianceSays) {
  SlamRig rig(rig_config(SyntheticWorldKind::Room, 2));
  int frames = 0;
  int in_band = 0;
  double last_trace = 0;
  for (std::uint64_t i = 0; i < 240; i += 3) {
    const PoseEstimate estimate = rig.track(i);
    ASSERT_TRUE(estimate.has_pose()) << i;
    const Eigen::LLT<Matrix6d> factor(estimate.covariance);
    ASSERT_EQ(factor.info(), Eigen::Success) << "frame " << i << ": filters need a positive definite matrix";
    ASSERT_LT((estimate.covariance - estimate.covariance.transpose()).cwiseAbs().maxCoeff(), 1e-15);
    if (i > 0) {
      const Vector6d xi = (estimate.T_map_camera().inverse() * rig.true_pose_in_map(i)).log();
      const double nees = xi.dot(factor.solve(xi));
      ++frames;
      in_band += nees > 1.237 && nees < 14.449 ? 1 : 0;  // 95 % of chi-squared with 6 degrees of freedom
    }
    last_trace = estimate.covariance.trace();
  }
  EXPECT_GE(in_band, 0.8 * frames);
  EXPECT_GT(last_trace, 2 * start_covariance().trace()) << "it is no longer where it began";
}

TEST(Tracker, GivesTheSameBitsTwice) {
  SlamRig a;
  SlamRig b;
  for (std::uint64_t i = 0; i < 30; ++i) {
    const PoseEstimate first = a.track(i);
    const PoseEstimate second = b.track(i);
    ASSERT_EQ(first.T_odom_camera.translation(), second.T_odom_camera.translation());
    ASSERT_EQ(first.T_odom_camera.rotation().coeffs(), second.T_odom_camera.rotation().coeffs());
    ASSERT_EQ(first.covariance, second.covariance);
    ASSERT_EQ(first.inliers, second.inliers);
  }
}

TEST(Tracker, IsLostInTheDarkAndFindsBack) {
  SlamRig rig;
  std::uint64_t i = 0;
  for (; i < 60; ++i) {
    ASSERT_TRUE(rig.track(i).has_pose()) << i;
  }
  ASSERT_GE(rig.mapper().keyframe_count(), 5U) << "a younger map would be begun anew";
  for (const std::uint64_t covered_until = i + 15; i < covered_until; ++i) {
    const PoseEstimate estimate = rig.track(i, cover_camera);
    EXPECT_EQ(estimate.state, i == 60 ? TrackingState::Lost : TrackingState::Relocalizing);
    EXPECT_FALSE(estimate.has_pose());
    EXPECT_FALSE(estimate.keyframe);
    EXPECT_EQ(estimate.inliers, 0);
  }
  bool found = false;
  for (const std::uint64_t deadline = i + 15; i < deadline && !found; ++i) {
    const PoseEstimate estimate = rig.track(i);
    found = estimate.has_pose();
    if (found) {
      EXPECT_LT(rig.error_m(i, estimate), 0.05);
      EXPECT_EQ(estimate.map_id, 1U);
    }
  }
  EXPECT_TRUE(found);
}

TEST(Tracker, WaitsForDepthBeforeItBegins) {
  SlamRig rig;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const PoseEstimate estimate = rig.track(i, take_depth_away);
    EXPECT_EQ(estimate.state, TrackingState::Initializing);
    EXPECT_FALSE(estimate.keyframe);
  }
  EXPECT_TRUE(rig.track(3).keyframe);
}

TEST(Tracker, TracksAFewFramesWithoutDepth) {
  SlamRig rig;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const PoseEstimate estimate = i % 4 == 3 ? rig.track(i, take_depth_away) : rig.track(i);
    ASSERT_TRUE(estimate.has_pose()) << i;
    EXPECT_LT(rig.error_m(i, estimate), 0.05);
  }
}

TEST(Tracker, DoesNotBeginWithoutRoomForTheKeyframe) {
  SlamRig rig;
  EXPECT_EQ(rig.track(0, SlamRig::Mapping::Never).state, TrackingState::Initializing);
  EXPECT_EQ(rig.track(1).state, TrackingState::Tracking);
}

TEST(Tracker, GoesOnWithoutKeyframesWhileTheMapperIsBehind) {
  SlamRig rig;
  ASSERT_TRUE(rig.track(0).keyframe);
  for (std::uint64_t i = 1; i < 15; ++i) {
    const PoseEstimate estimate = rig.track(i, SlamRig::Mapping::Never);
    EXPECT_TRUE(estimate.has_pose()) << i;
    EXPECT_FALSE(estimate.keyframe);
  }
}

TEST(Tracker, BeginsANewMapWhenAYoungOneIsLost) {
  SlamRig rig;
  ASSERT_TRUE(rig.track(0).has_pose());
  EXPECT_EQ(rig.track(1, cover_camera).state, TrackingState::Lost) << "nothing can be begun in the dark";
  constexpr std::uint64_t kElsewhere = 900;
  const PoseEstimate again = rig.track(kElsewhere);
  EXPECT_TRUE(again.has_pose());
  EXPECT_EQ(again.map_id, 2U);
  EXPECT_EQ(rig.track(kElsewhere + 1).map_id, 2U);
}

}  // namespace
}  // namespace posed
