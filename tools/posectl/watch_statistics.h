#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/clock.h"
#include "core/estimates.h"
#include "daemon/health.h"

/// What a subscriber of the daemon's poses can tell about them, apart from any transport. Everything here is reentrant.
namespace posed {

/// One received pose.
struct PoseSample {
  std::int64_t utime_us = 0;  ///< of capture, since 1970 UTC
  TimeNs capture_ns = 0;      ///< monotonic, of the publishing machine
  TimeNs publish_ns = 0;      ///< likewise
  TimeNs receive_ns = 0;      ///< monotonic, of this machine
  std::int64_t sequence = 0;
  TrackingState state = TrackingState::Initializing;
  bool has_pose = false;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();             ///< of T_map_camera
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< of T_map_camera
  double sigma_rotation_rad = 0;                                    ///< standard deviation in the worst direction
  double sigma_position_m = 0;                                      ///< likewise
  std::int32_t keypoints = 0;
  std::int32_t matches = 0;
  std::int32_t inliers = 0;
  std::int32_t map_id = 0;
};

/// Square root of the largest eigenvalue of a covariance.
double worst_sigma(const Eigen::Matrix3d& covariance);

/// Follows the sequence numbers of a stream.
class SequenceMonitor {
 public:
  /// `first`: the number the stream must begin with; without it any number may come first.
  explicit SequenceMonitor(std::optional<std::int64_t> first) : expected_(first) {}

  void observe(std::int64_t sequence, TimeNs capture_ns);

  std::uint64_t gaps() const { return gaps_; }          ///< places where numbers are missing
  std::uint64_t missing() const { return missing_; }    ///< numbers that are missing
  std::uint64_t late() const { return late_; }          ///< messages that came twice or after a later one
  std::uint64_t restarts() const { return restarts_; }  ///< times the numbers began anew with a later capture time

 private:
  std::optional<std::int64_t> expected_;
  TimeNs last_capture_ns_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t restarts_ = 0;
  bool any_ = false;
};

/// Sums up the poses seen so far.
struct WatchStatistics {
  explicit WatchStatistics(std::optional<std::int64_t> first_sequence) : sequence(first_sequence) {}

  void observe(const PoseSample& sample);

  SequenceMonitor sequence;
  std::uint64_t received = 0;
  std::uint64_t tracked = 0;  ///< with a pose
  TimeNs first_capture_ns = 0;
  PoseSample last;
  double rate_hz = 0;            ///< of the captures, smoothed over about a second
  LatencyHistogram publish_age;  ///< capture to publish
  LatencyHistogram receive_age;  ///< capture to receipt; means something on the publishing machine alone
};

/// The live table, one line an item, each ended. `health` is the daemon's last report, if one was received.
std::string format_watch_table(const WatchStatistics& statistics, const std::optional<HealthReport>& health);

/// The last pose and the counts on one line, without its end: what is printed now and then where there is no terminal.
std::string format_watch_line(const WatchStatistics& statistics);

/// "received N poses (T tracked), M gaps in sequence (K missing), ..." and latencies.
std::string format_watch_summary(const WatchStatistics& statistics);

/// Header and row of the table of all poses, each ended. A pose that is none leaves its cells empty.
std::string watch_csv_header();
std::string watch_csv_row(const PoseSample& sample);

}  // namespace posed
