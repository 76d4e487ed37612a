#include "core/estimates.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(TrackingState, HasAName) {
  EXPECT_EQ(to_string(TrackingState::Initializing), "initializing");
  EXPECT_EQ(to_string(TrackingState::Tracking), "tracking");
  EXPECT_EQ(to_string(TrackingState::Lost), "lost");
  EXPECT_EQ(to_string(TrackingState::Relocalizing), "relocalizing");
  EXPECT_EQ(to_string(static_cast<TrackingState>(200)), "unknown");
}

TEST(PoseEstimate, HasAPoseOnlyWhileTracking) {
  PoseEstimate estimate;
  EXPECT_FALSE(estimate.has_pose());
  for (const TrackingState state : {TrackingState::Lost, TrackingState::Relocalizing, TrackingState::Initializing}) {
    estimate.state = state;
    EXPECT_FALSE(estimate.has_pose());
  }
  estimate.state = TrackingState::Tracking;
  EXPECT_TRUE(estimate.has_pose());
}

TEST(PoseEstimate, MapPoseIsTheCorrectionAfterTheContinuousPose) {
  PoseEstimate estimate;
  estimate.T_map_odom = Se3(exp_so3({0, 0, 0.5 * static_cast<double>(EIGEN_PI)}), {10, 0, 0});
  estimate.T_odom_camera = Se3(Eigen::Quaterniond::Identity(), {1, 0, 0});
  EXPECT_TRUE(estimate.T_map_camera().translation().isApprox(Eigen::Vector3d(10, 1, 0), 1e-12));
}

}  // namespace
}  // namespace posed
