#include "daemon/message_conversion.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <posed/detections_t.hpp>

namespace posed {
namespace {

Se3 rotation_z(double angle_rad, const Eigen::Vector3d& translation) {
  return Se3(Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ())), translation);
}

/// Camera looking forward on a robot: its z is base's x, its x is base's -y; 0.2 m ahead of base and 0.5 m above it.
Se3 forward_camera() {
  Eigen::Matrix3d R_base_camera;
  R_base_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Se3(Eigen::Quaterniond(R_base_camera), Eigen::Vector3d(0.2, 0.0, 0.5));
}

PoseEstimate tracked_estimate() {
  PoseEstimate estimate;
  estimate.sequence = 42;
  estimate.capture_ns = 5'000'000'123;
  estimate.stamp_utc_ns = 1'700'000'000'123'456'789;
  estimate.state = TrackingState::Tracking;
  estimate.T_odom_camera = rotation_z(0.3, {1.0, 2.0, 3.0});
  estimate.T_map_odom = rotation_z(-1.1, {-4.0, 0.5, 0.25});
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      estimate.covariance(row, column) = 10 * row + column;
    }
  }
  estimate.keypoints = 900;
  estimate.matches = 300;
  estimate.inliers = 250;
  estimate.map_id = 3;
  estimate.map_version = 17;
  estimate.detection_age_ns = 30'000'000;
  estimate.masked_share = 0.25F;
  return estimate;
}

Se3 from_message(const transform_t& message) {
  const double* q = message.orientation;
  return Se3(Eigen::Quaterniond(q[3], q[0], q[1], q[2]), Eigen::Vector3d(message.position));
}

void expect_same(const Se3& a, const Se3& b) {
  EXPECT_LT((a.inverse() * b).log().norm(), 1e-12);
}

std::vector<double> pose_numbers(const pose_t& message) {
  std::vector<double> numbers(std::begin(message.covariance), std::end(message.covariance));
  for (const transform_t* T :
       {&message.T_map_camera, &message.T_odom_camera, &message.T_map_odom, &message.T_map_base, &message.T_odom_base}) {
    numbers.insert(numbers.end(), std::begin(T->position), std::end(T->position));
    numbers.insert(numbers.end(), std::begin(T->orientation), std::end(T->orientation));
  }
  return numbers;
}

TEST(PoseMessage, CarriesStampsAndCounts) {
  const pose_t message = to_pose_message(tracked_estimate(), Se3(), 5'000'000'999);
  EXPECT_EQ(message.utime, 1'700'000'000'123'456);
  EXPECT_EQ(message.capture_mono_ns, 5'000'000'123);
  EXPECT_EQ(message.publish_mono_ns, 5'000'000'999);
  EXPECT_EQ(message.sequence, 42);
  EXPECT_EQ(message.state, pose_t::STATE_TRACKING);
  EXPECT_EQ(message.has_pose, 1);
  EXPECT_EQ(message.keypoints, 900);
  EXPECT_EQ(message.matches, 300);
  EXPECT_EQ(message.inliers, 250);
  EXPECT_EQ(message.map_id, 3);
  EXPECT_EQ(message.map_version, 17);
  EXPECT_EQ(message.detection_age_ns, 30'000'000);
  EXPECT_EQ(message.masked_share, 0.25F);
}

TEST(PoseMessage, TransformsChainAsTheirNamesSay) {
  const PoseEstimate estimate = tracked_estimate();
  const pose_t message = to_pose_message(estimate, forward_camera(), 0);
  expect_same(from_message(message.T_odom_camera), estimate.T_odom_camera);
  expect_same(from_message(message.T_map_odom), estimate.T_map_odom);
  expect_same(from_message(message.T_map_odom) * from_message(message.T_odom_camera), from_message(message.T_map_camera));
  expect_same(from_message(message.T_map_base) * forward_camera(), from_message(message.T_map_camera));
  expect_same(from_message(message.T_odom_base) * forward_camera(), from_message(message.T_odom_camera));
}

TEST(PoseMessage, QuaternionsAreInTheOrderXyzw) {
  PoseEstimate estimate = tracked_estimate();
  estimate.T_map_odom = Se3();
  estimate.T_odom_camera = rotation_z(std::numbers::pi / 2, Eigen::Vector3d::Zero());
  const pose_t message = to_pose_message(estimate, Se3(), 0);
  EXPECT_NEAR(message.T_map_camera.orientation[0], 0.0, 1e-15);
  EXPECT_NEAR(message.T_map_camera.orientation[1], 0.0, 1e-15);
  EXPECT_NEAR(message.T_map_camera.orientation[2], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(message.T_map_camera.orientation[3], std::sqrt(0.5), 1e-15);
}

TEST(PoseMessage, CovarianceIsRowMajor) {
  const pose_t message = to_pose_message(tracked_estimate(), Se3(), 0);
  EXPECT_EQ(message.covariance[1], 1.0);   // row 0, column 1
  EXPECT_EQ(message.covariance[6], 10.0);  // row 1, column 0
  EXPECT_EQ(message.covariance[35], 55.0);
}

TEST(PoseMessage, AtTheStartBaseIsWhereTheConfigurationPutsIt) {
  const Se3 T_map_start = rotation_z(0.5, {10.0, -3.0, 0.1});
  PoseEstimate estimate = tracked_estimate();
  estimate.T_map_odom = Se3();
  estimate.T_odom_camera = T_map_start * forward_camera();  // what the tracker is started with
  expect_same(from_message(to_pose_message(estimate, forward_camera(), 0).T_map_base), T_map_start);
}

TEST(PoseMessage, WithAPoseEveryNumberIsFinite) {
  for (const double number : pose_numbers(to_pose_message(tracked_estimate(), forward_camera(), 0))) {
    EXPECT_TRUE(std::isfinite(number));
  }
}

TEST(PoseMessage, WithoutAPoseEveryNumberIsNaN) {
  for (const TrackingState state : {TrackingState::Initializing, TrackingState::Lost, TrackingState::Relocalizing}) {
    PoseEstimate estimate = tracked_estimate();  // a stale pose is still in it
    estimate.state = state;
    const pose_t message = to_pose_message(estimate, forward_camera(), 7);
    EXPECT_EQ(message.has_pose, 0);
    EXPECT_EQ(message.state, static_cast<int>(state));
    EXPECT_EQ(message.sequence, 42);
    const std::vector<double> numbers = pose_numbers(message);
    EXPECT_EQ(numbers.size(), 36U + 5U * 7U);
    EXPECT_TRUE(std::all_of(numbers.begin(), numbers.end(), [](double number) { return std::isnan(number); }));
  }
}

TEST(BotCorePose, IsBaseInMapWithScalarFirst) {
  const PoseEstimate estimate = tracked_estimate();
  const std::optional<bot_core::pose_t> message = to_bot_core_pose(estimate, forward_camera());
  ASSERT_TRUE(message);
  EXPECT_EQ(message->utime, 1'700'000'000'123'456);
  const Eigen::Quaterniond q(message->orientation[0], message->orientation[1], message->orientation[2], message->orientation[3]);
  expect_same(Se3(q, Eigen::Vector3d(message->pos)) * forward_camera(), estimate.T_map_camera());
  EXPECT_TRUE(std::isnan(message->vel[0]) && std::isnan(message->rotation_rate[1]) && std::isnan(message->accel[2]));
}

TEST(BotCorePose, IsWithheldWithoutAPose) {
  PoseEstimate estimate = tracked_estimate();
  estimate.state = TrackingState::Lost;
  EXPECT_FALSE(to_bot_core_pose(estimate, forward_camera()));
}

TEST(BotCorePose, HasTheFingerprintThatItsSubscribersKnow) {
  // LCM refuses a message whose fingerprint differs; this one follows from libbot's layout.
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::pose_t::getHash()), 0x2e16efb052b0105eULL);
}

TEST(StatusMessage, CarriesEveryFieldOfTheReport) {
  HealthReport health;
  health.state = TrackingState::Lost;
  health.source_failed = true;
  health.frames_captured = 1;
  health.frames_skipped = 2;
  health.frames_no_slot = 3;
  health.frames_dropped = 4;
  health.frames_tracked = 5;
  health.frames_lost = 6;
  health.keyframes = 7;
  health.keyframes_delayed = 8;
  health.poses_published = 9;
  health.poses_dropped = 10;
  health.publish_errors = 11;
  health.map_keyframes = 12;
  health.map_landmarks = 13;
  health.peak_rss_bytes = 14;
  health.frames_missed = 15;
  health.map_saves = 16;
  health.map_save_errors = 17;
  health.loops_closed = 18;
  health.maps_joined = 19;
  health.relocalizations = 20;
  health.frames_paused = 21;
  health.gpio.trigger_pulses = 22;
  health.gpio.trigger_missed = 23;
  health.gpio.worst_trigger_lateness_ns = 24;
  health.paused = true;
  health.gpio.ok = false;
  health.track = {100, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  health.latency.count = 200;
  health.map.count = 300;

  const status_t m = to_status_message(health, {77, 88'123, "0.1.0", "memq://"});
  EXPECT_EQ(m.mono_ns, 77);
  EXPECT_EQ(m.utime, 88);
  EXPECT_EQ(m.version, "0.1.0");
  EXPECT_EQ(m.transport, "memq://");
  EXPECT_EQ(m.state, pose_t::STATE_LOST);
  EXPECT_EQ(m.source_failed, 1);
  EXPECT_EQ(m.source_ended, 0);
  EXPECT_EQ(m.paused, 1);
  EXPECT_EQ(m.gpio_ok, 0);
  EXPECT_EQ(to_status_message(HealthReport{}, {}).paused, 0);
  EXPECT_EQ(to_status_message(HealthReport{}, {}).gpio_ok, 1);
  const std::vector<std::int64_t> counters = {
      m.frames_captured, m.frames_skipped,    m.frames_no_slot,  m.frames_dropped, m.frames_tracked,  m.frames_lost,
      m.keyframes,       m.keyframes_delayed, m.poses_published, m.poses_dropped,  m.publish_errors,  m.map_keyframes,
      m.map_landmarks,   m.peak_rss_bytes,    m.frames_missed,   m.map_saves,      m.map_save_errors, m.loops_closed,
      m.maps_joined,     m.relocalizations,   m.frames_paused,   m.trigger_pulses, m.trigger_missed,  m.trigger_worst_lateness_ns};
  for (std::size_t i = 0; i < counters.size(); ++i) {
    EXPECT_EQ(counters[i], static_cast<std::int64_t>(i) + 1);
  }
  EXPECT_EQ(m.track.count, 100);
  EXPECT_EQ(m.track.mean_ms, 1.0);
  EXPECT_EQ(m.track.p50_ms, 2.0);
  EXPECT_EQ(m.track.p95_ms, 3.0);
  EXPECT_EQ(m.track.p99_ms, 4.0);
  EXPECT_EQ(m.track.p999_ms, 5.0);
  EXPECT_EQ(m.track.max_ms, 6.0);
  EXPECT_EQ(m.latency.count, 200);
  EXPECT_EQ(m.map.count, 300);
}

TEST(DetectionsMessage, SurvivesTheWire) {
  detections_t sent{};
  sent.sequence = 4;
  sent.image_width = 640;
  sent.image_height = 480;
  sent.count = 2;
  sent.detections.resize(2);
  sent.detections[1].label = "person";
  sent.detections[1].score = 0.75F;
  sent.detections[1].x_max = 320.5F;
  std::vector<std::uint8_t> wire(static_cast<std::size_t>(sent.getEncodedSize()));
  ASSERT_EQ(sent.encode(wire.data(), 0, static_cast<int>(wire.size())), static_cast<int>(wire.size()));
  detections_t received;
  ASSERT_EQ(received.decode(wire.data(), 0, static_cast<int>(wire.size())), static_cast<int>(wire.size()));
  ASSERT_EQ(received.count, 2);
  EXPECT_EQ(received.detections[1].label, "person");
  EXPECT_EQ(received.detections[1].score, 0.75F);
  EXPECT_EQ(received.detections[1].x_max, 320.5F);
}

}  // namespace
}  // namespace posed
