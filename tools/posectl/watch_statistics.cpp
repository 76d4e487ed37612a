#include "tools/posectl/watch_statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

namespace posed {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
constexpr double kRateSmoothing_s = 1.0;

std::string position_text(const PoseSample& sample) {
  if (!sample.has_pose) {
    return "none";
  }
  return fmt::format("{:+.3f} {:+.3f} {:+.3f} m  sigma {:.1f} mm", sample.position_m.x(), sample.position_m.y(),
                     sample.position_m.z(), sample.sigma_position_m * 1e3);
}

std::string rotation_text(const PoseSample& sample) {
  if (!sample.has_pose) {
    return "none";
  }
  const Eigen::Vector3d phi_deg = log_so3(sample.orientation) * kDegreesPerRadian;
  return fmt::format("{:+.2f} {:+.2f} {:+.2f} deg (rotation vector)  sigma {:.3f} deg", phi_deg.x(), phi_deg.y(), phi_deg.z(),
                     sample.sigma_rotation_rad * kDegreesPerRadian);
}

std::string sequence_text(const SequenceMonitor& sequence) {
  std::string text = fmt::format("{} gaps in sequence ({} missing)", sequence.gaps(), sequence.missing());
  if (sequence.late() > 0) {
    text += fmt::format(", {} late or repeated", sequence.late());
  }
  if (sequence.restarts() > 0) {
    text += fmt::format(", {} restarts of the daemon", sequence.restarts());
  }
  return text;
}

/// Nothing where no lines are used.
std::string lines_text(const HealthReport& health) {
  std::string text;
  if (!health.gpio.ok) {
    text += "lines      a GPIO line is missing\n";
  }
  if (health.gpio.trigger_pulses > 0) {
    text += fmt::format("trigger    {} pulses  {} missed  at most {:.3f} ms late\n", health.gpio.trigger_pulses,
                        health.gpio.trigger_missed, to_ms(health.gpio.worst_trigger_lateness_ns));
  }
  return text;
}

std::string health_table(const HealthReport& health) {
  return fmt::format("frames     captured {}  tracked {}  lost {}  dropped {}  missed {}  no slot {}  skipped {}\n",
                     health.frames_captured, health.frames_tracked, health.frames_lost, health.frames_dropped, health.frames_missed,
                     health.frames_no_slot, health.frames_skipped) +
         fmt::format(
             "map        {} keyframes  {} landmarks  {} loops closed  {} joined  {} relocalised  saved {} times  errors {}\n",
             health.map_keyframes, health.map_landmarks, health.loops_closed, health.maps_joined, health.relocalizations,
             health.map_saves, health.map_save_errors) +
         fmt::format("poses      published {}  dropped {}  errors {}\n", health.poses_published, health.poses_dropped,
                     health.publish_errors) +
         fmt::format("tracker    p50 {:.2f}  p99 {:.2f}  max {:.2f} ms\n", health.track.p50_ms, health.track.p99_ms,
                     health.track.max_ms) +
         lines_text(health) +
         fmt::format("daemon     {:.0f} MB at most{}{}\n", static_cast<double>(health.peak_rss_bytes) * 1e-6,
                     health.paused ? ", paused" : "",
                     health.source_failed  ? ", the source has failed"
                     : health.source_ended ? ", the source has ended"
                                           : "");
}

}  // namespace

double worst_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
}

void SequenceMonitor::observe(std::int64_t sequence, TimeNs capture_ns) {
  const std::int64_t expected = expected_.value_or(sequence);
  if (sequence > expected) {
    ++gaps_;
    missing_ += static_cast<std::uint64_t>(sequence - expected);
  } else if (sequence < expected && any_ && capture_ns > last_capture_ns_) {
    ++restarts_;
  } else if (sequence < expected) {
    ++late_;
    return;
  }
  any_ = true;
  expected_ = sequence + 1;
  last_capture_ns_ = capture_ns;
}

void WatchStatistics::observe(const PoseSample& sample) {
  sequence.observe(sample.sequence, sample.capture_ns);
  if (received == 0) {
    first_capture_ns = sample.capture_ns;
  } else if (sample.capture_ns > last.capture_ns) {
    const double interval_s = to_seconds(sample.capture_ns - last.capture_ns);
    const double weight = rate_hz == 0 ? 1.0 : 1.0 - std::exp(-interval_s / kRateSmoothing_s);
    rate_hz += weight * (1.0 / interval_s - rate_hz);
  }
  ++received;
  tracked += sample.has_pose ? 1 : 0;
  publish_age.record(sample.publish_ns - sample.capture_ns);
  receive_age.record(sample.receive_ns - sample.capture_ns);
  last = sample;
}

std::string format_watch_table(const WatchStatistics& statistics, const std::optional<HealthReport>& health) {
  const PoseSample& last = statistics.last;
  std::string table =
      fmt::format("state      {}  map {}\n", to_string(last.state), last.map_id) +
      fmt::format("position   {}\n", position_text(last)) + fmt::format("rotation   {}\n", rotation_text(last)) +
      fmt::format("features   {} keypoints  {} matches  {} inliers\n", last.keypoints, last.matches, last.inliers) +
      fmt::format("rate       {:.1f} Hz  frame {}  published after {:.1f} ms, received after {:.1f} ms\n", statistics.rate_hz,
                  last.sequence, to_ms(last.publish_ns - last.capture_ns), to_ms(last.receive_ns - last.capture_ns)) +
      fmt::format("received   {} poses ({} tracked), {}\n", statistics.received, statistics.tracked,
                  sequence_text(statistics.sequence));
  return health ? table + health_table(*health) : table + "daemon     no status received yet\n";
}

std::string format_watch_line(const WatchStatistics& statistics) {
  const PoseSample& last = statistics.last;
  return fmt::format("frame {}  {}  {}  inliers {}  {:.1f} Hz  {:.1f} ms  received {}  missing {}", last.sequence,
                     to_string(last.state), position_text(last), last.inliers, statistics.rate_hz,
                     to_ms(last.publish_ns - last.capture_ns), statistics.received, statistics.sequence.missing());
}

std::string format_watch_summary(const WatchStatistics& statistics) {
  const LatencySummary published = statistics.publish_age.summary();
  const LatencySummary received = statistics.receive_age.summary();
  const double span_s = to_seconds(statistics.last.capture_ns - statistics.first_capture_ns);
  return fmt::format("received {} poses ({} tracked), {}, over {:.1f} s\n", statistics.received, statistics.tracked,
                     sequence_text(statistics.sequence), span_s) +
         fmt::format("capture to publish p50 {:.2f}  p99 {:.2f}  max {:.2f} ms; to receipt p50 {:.2f}  p99 {:.2f}  max {:.2f} ms\n",
                     published.p50_ms, published.p99_ms, published.max_ms, received.p50_ms, received.p99_ms, received.max_ms);
}

std::string watch_csv_header() {
  return "sequence,utime_us,capture_ns,publish_ns,receive_ns,state,tx_m,ty_m,tz_m,qx,qy,qz,qw,sigma_position_m,sigma_rotation_rad,"
         "keypoints,matches,inliers,map_id\n";
}

std::string watch_csv_row(const PoseSample& sample) {
  std::string pose = ",,,,,,,,";
  if (sample.has_pose) {
    const Eigen::Vector3d& t = sample.position_m;
    const Eigen::Quaterniond& q = sample.orientation;
    pose = fmt::format("{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.6g},{:.6g}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                       q.w(), sample.sigma_position_m, sample.sigma_rotation_rad);
  }
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", sample.sequence, sample.utime_us, sample.capture_ns, sample.publish_ns,
                     sample.receive_ns, to_string(sample.state), pose, sample.keypoints, sample.matches, sample.inliers,
                     sample.map_id);
}

}  // namespace posed
