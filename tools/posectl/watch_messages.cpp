#include "tools/posectl/watch_messages.h"

#include <cstdint>

#include <Eigen/Core>

namespace posed {
namespace {

TrackingState state_of(std::int8_t state) {
  switch (state) {
    case pose_t::STATE_TRACKING: return TrackingState::Tracking;
    case pose_t::STATE_LOST: return TrackingState::Lost;
    case pose_t::STATE_RELOCALIZING: return TrackingState::Relocalizing;
    default: return TrackingState::Initializing;
  }
}

std::uint64_t count_of(std::int64_t value) {
  return static_cast<std::uint64_t>(value);
}

LatencySummary latency_of(const latency_t& message) {
  return {.count = count_of(message.count),
          .mean_ms = message.mean_ms,
          .p50_ms = message.p50_ms,
          .p95_ms = message.p95_ms,
          .p99_ms = message.p99_ms,
          .p999_ms = message.p999_ms,
          .max_ms = message.max_ms};
}

}  // namespace

PoseSample from_pose_message(const pose_t& message, TimeNs receive_ns) {
  PoseSample sample;
  sample.utime_us = message.utime;
  sample.capture_ns = message.capture_mono_ns;
  sample.publish_ns = message.publish_mono_ns;
  sample.receive_ns = receive_ns;
  sample.sequence = message.sequence;
  sample.state = state_of(message.state);
  sample.has_pose = message.has_pose != 0;
  if (sample.has_pose) {
    sample.position_m = Eigen::Map<const Eigen::Vector3d>(message.T_map_camera.position);
    sample.orientation = Eigen::Quaterniond(message.T_map_camera.orientation);  // x, y, z, w: Eigen's own order in memory
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(message.covariance);
    sample.sigma_rotation_rad = worst_sigma(covariance.topLeftCorner<3, 3>());
    sample.sigma_position_m = worst_sigma(covariance.bottomRightCorner<3, 3>());
  }
  sample.keypoints = message.keypoints;
  sample.matches = message.matches;
  sample.inliers = message.inliers;
  sample.map_id = message.map_id;
  return sample;
}

HealthReport from_status_message(const status_t& message) {
  HealthReport health;
  health.state = state_of(message.state);
  health.source_failed = message.source_failed != 0;
  health.source_ended = message.source_ended != 0;
  health.source.connected = message.source_connected != 0;
  health.source.reconnects = count_of(message.source_reconnects);
  health.source.stalls = count_of(message.source_stalls);
  health.source.unpaired = count_of(message.source_unpaired);
  health.source.clock_resets = count_of(message.source_clock_resets);
  health.source.clock_error_ns = message.source_clock_error_ns;
  health.paused = message.paused != 0;
  health.gpio.ok = message.gpio_ok != 0;
  health.gpio.trigger_pulses = count_of(message.trigger_pulses);
  health.gpio.trigger_missed = count_of(message.trigger_missed);
  health.gpio.worst_trigger_lateness_ns = message.trigger_worst_lateness_ns;
  health.frames_captured = count_of(message.frames_captured);
  health.frames_paused = count_of(message.frames_paused);
  health.frames_skipped = count_of(message.frames_skipped);
  health.frames_missed = count_of(message.frames_missed);
  health.frames_no_slot = count_of(message.frames_no_slot);
  health.frames_dropped = count_of(message.frames_dropped);
  health.frames_tracked = count_of(message.frames_tracked);
  health.frames_lost = count_of(message.frames_lost);
  health.keyframes = count_of(message.keyframes);
  health.keyframes_delayed = count_of(message.keyframes_delayed);
  health.poses_published = count_of(message.poses_published);
  health.poses_dropped = count_of(message.poses_dropped);
  health.publish_errors = count_of(message.publish_errors);
  health.transport_up = true;  // the message came
  health.map_keyframes = count_of(message.map_keyframes);
  health.map_landmarks = count_of(message.map_landmarks);
  health.map_saves = count_of(message.map_saves);
  health.map_save_errors = count_of(message.map_save_errors);
  health.loops_closed = count_of(message.loops_closed);
  health.maps_joined = count_of(message.maps_joined);
  health.relocalizations = count_of(message.relocalizations);
  health.track = latency_of(message.track);
  health.latency = latency_of(message.latency);
  health.map = latency_of(message.map);
  health.peak_rss_bytes = count_of(message.peak_rss_bytes);
  return health;
}

}  // namespace posed
