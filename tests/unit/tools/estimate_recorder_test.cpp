#include "tools/posectl/estimate_recorder.h"

#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

namespace posed {
namespace {

Se3 shift(double x) {
  return Se3(Eigen::Quaterniond::Identity(), {x, 0, 0});
}

PoseEstimate estimate(std::uint64_t sequence, TrackingState state, std::uint64_t keyframe) {
  PoseEstimate pose;
  pose.sequence = sequence;
  pose.stamp_utc_ns = 1'000 + static_cast<std::int64_t>(sequence);
  pose.state = state;
  pose.T_odom_camera = shift(static_cast<double>(sequence));
  pose.T_map_odom = shift(100);
  pose.reference_keyframe = keyframe;
  pose.T_reference_camera = shift(0.5);
  return pose;
}

TEST(EstimateRecorder, OnlineTrajectoryIsWhatWasPublished) {
  EstimateRecorder recorder(4);
  recorder.record(estimate(0, TrackingState::Initializing, 0));
  recorder.record(estimate(1, TrackingState::Tracking, 1));
  recorder.record(estimate(2, TrackingState::Lost, 1));
  recorder.record(estimate(3, TrackingState::Tracking, 2));
  const Trajectory trajectory = recorder.online_trajectory();
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].stamp_ns, 1'001);
  EXPECT_EQ(trajectory[0].T_world_camera.translation().x(), 101);
  EXPECT_EQ(trajectory[1].T_world_camera.translation().x(), 103);
}

TEST(EstimateRecorder, ResidualsAreThoseOfTrackedFrames) {
  EstimateRecorder recorder(4);
  EXPECT_EQ(recorder.residual_variance(), 0.0);
  PoseEstimate pose = estimate(0, TrackingState::Tracking, 1);
  for (const double variance : {0.5, 1.0}) {
    pose.residual_variance = variance;
    recorder.record(pose);
  }
  pose.state = TrackingState::Lost;
  pose.residual_variance = 7.0;
  recorder.record(pose);
  EXPECT_EQ(recorder.residual_variance(), 0.75);
}

TEST(EstimateRecorder, KeepsEveryFrameForTheTruth) {
  EstimateRecorder recorder(2);
  recorder.record(estimate(0, TrackingState::Lost, 0));
  recorder.record(estimate(4, TrackingState::Tracking, 1));
  ASSERT_EQ(recorder.frames().size(), 2u);
  EXPECT_EQ(recorder.frames()[0].sequence, 0u);
  EXPECT_EQ(recorder.frames()[1].sequence, 4u);
  EXPECT_EQ(recorder.frames()[1].stamp_utc_ns, 1'004);
}

TEST(EstimateRecorder, FinalTrajectoryFollowsTheKeyframes) {
  EstimateRecorder recorder(2);
  recorder.record(estimate(1, TrackingState::Tracking, 1));
  recorder.record(estimate(2, TrackingState::Tracking, 2));
  recorder.record(estimate(3, TrackingState::Tracking, 9));
  const EstimateRecorder::Final result = recorder.final_trajectory([](std::uint64_t keyframe) {
    return keyframe < 9 ? std::optional(shift(10.0 * static_cast<double>(keyframe))) : std::nullopt;
  });
  ASSERT_EQ(result.trajectory.size(), 2u);
  EXPECT_EQ(result.trajectory[0].T_world_camera.translation().x(), 10.5);
  EXPECT_EQ(result.trajectory[1].T_world_camera.translation().x(), 20.5);
  EXPECT_EQ(result.without_keyframe, 1u);
}

}  // namespace
}  // namespace posed
