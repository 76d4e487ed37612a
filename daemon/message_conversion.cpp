#include "daemon/message_conversion.h"

#include <algorithm>
#include <iterator>
#include <limits>

namespace posed {

namespace {

static_assert(pose_t::STATE_INITIALIZING == static_cast<int>(TrackingState::Initializing));
static_assert(pose_t::STATE_TRACKING == static_cast<int>(TrackingState::Tracking));
static_assert(pose_t::STATE_LOST == static_cast<int>(TrackingState::Lost));
static_assert(pose_t::STATE_RELOCALIZING == static_cast<int>(TrackingState::Relocalizing));

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <std::size_t N>
void fill_nan(double (&values)[N]) {
  std::fill(std::begin(values), std::end(values), kNaN);
}

transform_t to_message(const Se3& T) {
  transform_t message;
  Eigen::Map<Eigen::Vector3d>(message.position) = T.translation();
  Eigen::Map<Eigen::Vector4d>(message.orientation) = T.rotation().coeffs();  // Eigen stores x, y, z, w
  return message;
}

transform_t no_transform() {
  transform_t message;
  fill_nan(message.position);
  fill_nan(message.orientation);
  return message;
}

latency_t to_message(const LatencySummary& summary) {
  latency_t message;
  message.count = static_cast<std::int64_t>(summary.count);
  message.mean_ms = summary.mean_ms;
  message.p50_ms = summary.p50_ms;
  message.p95_ms = summary.p95_ms;
  message.p99_ms = summary.p99_ms;
  message.p999_ms = summary.p999_ms;
  message.max_ms = summary.max_ms;
  return message;
}

void fill_pose(pose_t& message, const PoseEstimate& estimate, const Se3& T_base_camera) {
  const Se3 T_camera_base = T_base_camera.inverse();
  message.T_map_camera = to_message(estimate.T_map_camera());
  message.T_odom_camera = to_message(estimate.T_odom_camera);
  message.T_map_odom = to_message(estimate.T_map_odom);
  message.T_map_base = to_message(estimate.T_map_camera() * T_camera_base);
  message.T_odom_base = to_message(estimate.T_odom_camera * T_camera_base);
  using RowMajor6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  Eigen::Map<RowMajor6d>(message.covariance) = estimate.covariance;
}

void fill_no_pose(pose_t& message) {
  message.T_map_camera = no_transform();
  message.T_odom_camera = no_transform();
  message.T_map_odom = no_transform();
  message.T_map_base = no_transform();
  message.T_odom_base = no_transform();
  fill_nan(message.covariance);
}

}  // namespace

pose_t to_pose_message(const PoseEstimate& estimate, const Se3& T_base_camera, TimeNs publish_ns) {
  pose_t message;
  message.utime = estimate.stamp_utc_ns / kNsPerUs;
  message.capture_mono_ns = estimate.capture_ns;
  message.publish_mono_ns = publish_ns;
  message.sequence = static_cast<std::int64_t>(estimate.sequence);
  message.state = static_cast<std::int8_t>(estimate.state);
  message.has_pose = estimate.has_pose() ? 1 : 0;
  message.map_id = static_cast<std::int32_t>(estimate.map_id);
  message.map_version = static_cast<std::int64_t>(estimate.map_version);
  if (estimate.has_pose()) {
    fill_pose(message, estimate, T_base_camera);
  } else {
    fill_no_pose(message);
  }
  message.keypoints = estimate.keypoints;
  message.matches = estimate.matches;
  message.inliers = estimate.inliers;
  message.detection_age_ns = estimate.detection_age_ns;
  message.masked_share = estimate.masked_share;
  return message;
}

std::optional<bot_core::pose_t> to_bot_core_pose(const PoseEstimate& estimate, const Se3& T_base_camera) {
  if (!estimate.has_pose()) {
    return std::nullopt;
  }
  const Se3 T_map_base = estimate.T_map_camera() * T_base_camera.inverse();
  bot_core::pose_t message;
  message.utime = estimate.stamp_utc_ns / kNsPerUs;
  Eigen::Map<Eigen::Vector3d>(message.pos) = T_map_base.translation();
  const Eigen::Quaterniond& q = T_map_base.rotation();
  Eigen::Map<Eigen::Vector4d>(message.orientation) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  fill_nan(message.vel);
  fill_nan(message.rotation_rate);
  fill_nan(message.accel);
  return message;
}

detections_t to_detections_message(const Detections& detections, TimeNs publish_ns) {
  detections_t message;
  message.utime = detections.stamp_utc_ns / kNsPerUs;
  message.capture_mono_ns = detections.capture_ns;
  message.publish_mono_ns = publish_ns;
  message.sequence = static_cast<std::int64_t>(detections.sequence);
  message.image_width = detections.image_width;
  message.image_height = detections.image_height;
  message.count = static_cast<std::int32_t>(detections.count);
  for (const Detection& found : detections.found()) {
    detection_t person;
    person.label = "person";
    person.score = found.score;
    person.x_min = found.box.x_min;
    person.y_min = found.box.y_min;
    person.x_max = found.box.x_max;
    person.y_max = found.box.y_max;
    message.detections.push_back(person);
  }
  return message;
}

status_t to_status_message(const HealthReport& health, const StatusOrigin& origin) {
  const auto count = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
  status_t message;
  message.utime = origin.utc_ns / kNsPerUs;
  message.mono_ns = origin.mono_ns;
  message.version = origin.version;
  message.transport = origin.transport;
  message.state = static_cast<std::int8_t>(health.state);
  message.source_failed = health.source_failed ? 1 : 0;
  message.source_ended = health.source_ended ? 1 : 0;
  message.source_connected = health.source.connected ? 1 : 0;
  message.source_reconnects = count(health.source.reconnects);
  message.source_stalls = count(health.source.stalls);
  message.source_unpaired = count(health.source.unpaired);
  message.source_clock_resets = count(health.source.clock_resets);
  message.source_clock_error_ns = health.source.clock_error_ns;
  message.paused = health.paused ? 1 : 0;
  message.gpio_ok = health.gpio.ok ? 1 : 0;
  message.trigger_pulses = count(health.gpio.trigger_pulses);
  message.trigger_missed = count(health.gpio.trigger_missed);
  message.trigger_worst_lateness_ns = health.gpio.worst_trigger_lateness_ns;
  message.frames_captured = count(health.frames_captured);
  message.frames_paused = count(health.frames_paused);
  message.frames_skipped = count(health.frames_skipped);
  message.frames_missed = count(health.frames_missed);
  message.frames_no_slot = count(health.frames_no_slot);
  message.frames_dropped = count(health.frames_dropped);
  message.frames_tracked = count(health.frames_tracked);
  message.frames_lost = count(health.frames_lost);
  message.keyframes = count(health.keyframes);
  message.keyframes_delayed = count(health.keyframes_delayed);
  message.poses_published = count(health.poses_published);
  message.poses_dropped = count(health.poses_dropped);
  message.publish_errors = count(health.publish_errors);
  message.map_keyframes = count(health.map_keyframes);
  message.map_landmarks = count(health.map_landmarks);
  message.map_saves = count(health.map_saves);
  message.map_save_errors = count(health.map_save_errors);
  message.loops_closed = count(health.loops_closed);
  message.maps_joined = count(health.maps_joined);
  message.relocalizations = count(health.relocalizations);
  message.detector_model = health.detector_model;
  message.detected = count(health.detected);
  message.detections_abandoned = count(health.detections_abandoned);
  message.detections_dropped = count(health.detections_dropped);
  message.detector_errors = count(health.detector_errors);
  message.peak_rss_bytes = count(health.peak_rss_bytes);
  message.track = to_message(health.track);
  message.latency = to_message(health.latency);
  message.map = to_message(health.map);
  message.masked_share = health.masked_share;
  message.people = health.people;
  message.other_movers = health.other_movers;
  message.detection_age_ns = health.detection_age_ns;
  message.detect = to_message(health.detect);
  message.detect_overrun = to_message(health.detect_overrun);
  return message;
}

}  // namespace posed
