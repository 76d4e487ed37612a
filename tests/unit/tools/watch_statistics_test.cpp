#include "tools/posectl/watch_statistics.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using testing::HasSubstr;
using testing::Not;

PoseSample sample(std::int64_t sequence, TrackingState state = TrackingState::Tracking) {
  PoseSample pose;
  pose.sequence = sequence;
  pose.capture_ns = 1'000 * kNsPerSecond + sequence * 40 * kNsPerMs;
  pose.publish_ns = pose.capture_ns + 10 * kNsPerMs;
  pose.receive_ns = pose.capture_ns + 11 * kNsPerMs;
  pose.utime_us = 1'700'000'000'000'000 + sequence * 40'000;
  pose.state = state;
  pose.has_pose = state == TrackingState::Tracking;
  pose.position_m = {0.1, -0.2, 1.5};
  pose.sigma_position_m = 0.0021;
  pose.sigma_rotation_rad = 0.001;
  pose.keypoints = 1000;
  pose.matches = 400;
  pose.inliers = 380;
  pose.map_id = 1;
  return pose;
}

SequenceMonitor monitor_of(std::initializer_list<std::int64_t> sequences, std::optional<std::int64_t> first = std::nullopt) {
  SequenceMonitor monitor(first);
  for (const std::int64_t sequence : sequences) {
    monitor.observe(sequence, sequence * kNsPerMs);
  }
  return monitor;
}

TEST(SequenceMonitor, AStreamWithoutGapsHasNone) {
  const SequenceMonitor monitor = monitor_of({17, 18, 19, 20});
  EXPECT_EQ(monitor.gaps(), 0u);
  EXPECT_EQ(monitor.missing(), 0u);
  EXPECT_EQ(monitor.late(), 0u);
  EXPECT_EQ(monitor.restarts(), 0u);
}

TEST(SequenceMonitor, CountsPlacesAndMissingNumbers) {
  const SequenceMonitor monitor = monitor_of({0, 1, 4, 5, 7});
  EXPECT_EQ(monitor.gaps(), 2u);
  EXPECT_EQ(monitor.missing(), 3u);
}

TEST(SequenceMonitor, CountsWhatIsMissingAtTheBeginningWhereTheFirstNumberIsKnown) {
  EXPECT_EQ(monitor_of({3, 4}, 0).missing(), 3u);
  EXPECT_EQ(monitor_of({3, 4}, 0).gaps(), 1u);
  EXPECT_EQ(monitor_of({0, 1}, 0).gaps(), 0u);
}

TEST(SequenceMonitor, RepeatedAndLateMessagesAreNoGap) {
  const SequenceMonitor monitor = monitor_of({5, 6, 6, 5, 7});
  EXPECT_EQ(monitor.late(), 2u);
  EXPECT_EQ(monitor.gaps(), 0u);
}

TEST(SequenceMonitor, NumbersThatBeginAnewLaterInTimeAreARestart) {
  SequenceMonitor monitor(std::nullopt);
  monitor.observe(100, 5 * kNsPerSecond);
  monitor.observe(0, 9 * kNsPerSecond);
  monitor.observe(1, 10 * kNsPerSecond);
  EXPECT_EQ(monitor.restarts(), 1u);
  EXPECT_EQ(monitor.gaps(), 0u);
}

TEST(WorstSigma, IsTheLongestAxisOfTheEllipsoid) {
  const Eigen::Matrix3d rotation = exp_so3({0.3, -0.5, 0.2}).toRotationMatrix();
  const Eigen::Matrix3d covariance = rotation * Eigen::Vector3d(1e-4, 9e-4, 4e-4).asDiagonal() * rotation.transpose();
  EXPECT_NEAR(worst_sigma(covariance), 0.03, 1e-12);
  EXPECT_EQ(worst_sigma(Eigen::Matrix3d::Zero()), 0.0);
}

TEST(WatchStatistics, CountsPosesAndRate) {
  WatchStatistics statistics(std::nullopt);
  for (int i = 0; i < 50; ++i) {
    statistics.observe(sample(i, i < 10 ? TrackingState::Lost : TrackingState::Tracking));
  }
  EXPECT_EQ(statistics.received, 50u);
  EXPECT_EQ(statistics.tracked, 40u);
  EXPECT_NEAR(statistics.rate_hz, 25.0, 1e-6);
  EXPECT_NEAR(statistics.publish_age.summary().max_ms, 10.0, 1e-9);
}

TEST(WatchTable, ShowsPoseAndHealth) {
  WatchStatistics statistics(std::nullopt);
  statistics.observe(sample(0));
  statistics.observe(sample(3));
  HealthReport health;
  health.frames_captured = 4;
  health.frames_dropped = 2;
  health.source_ended = true;
  const std::string table = format_watch_table(statistics, health);
  EXPECT_THAT(table, HasSubstr("state      tracking  map 1\n"));
  EXPECT_THAT(table, HasSubstr("position   +0.100 -0.200 +1.500 m  sigma 2.1 mm\n"));
  EXPECT_THAT(table, HasSubstr("1000 keypoints  400 matches  380 inliers\n"));
  EXPECT_THAT(table, HasSubstr("frame 3  published after 10.0 ms, received after 11.0 ms\n"));
  EXPECT_THAT(table, HasSubstr("received   2 poses (2 tracked), 1 gaps in sequence (2 missing)\n"));
  EXPECT_THAT(table, HasSubstr("captured 4  tracked 0  lost 0  dropped 2"));
  EXPECT_THAT(table, HasSubstr("the source has ended"));
  EXPECT_TRUE(table.ends_with("\n"));
}

TEST(WatchTable, TellsOfPausesAndLinesWhereThereAreSome) {
  HealthReport health;
  EXPECT_THAT(format_watch_table(WatchStatistics(std::nullopt), health), Not(HasSubstr("trigger")));
  EXPECT_THAT(format_watch_table(WatchStatistics(std::nullopt), health), Not(HasSubstr("paused")));
  health.paused = true;
  health.gpio = {.ok = false, .trigger_pulses = 300, .trigger_missed = 1, .worst_trigger_lateness_ns = 120 * kNsPerUs};
  const std::string table = format_watch_table(WatchStatistics(std::nullopt), health);
  EXPECT_THAT(table, HasSubstr("a GPIO line is missing\n"));
  EXPECT_THAT(table, HasSubstr("trigger    300 pulses  1 missed  at most 0.120 ms late\n"));
  EXPECT_THAT(table, HasSubstr("MB at most, paused\n"));
}

TEST(WatchTable, ShowsNoNumbersWhereThereIsNoPose) {
  WatchStatistics statistics(std::nullopt);
  statistics.observe(sample(0, TrackingState::Lost));
  const std::string table = format_watch_table(statistics, std::nullopt);
  EXPECT_THAT(table, HasSubstr("position   none\n"));
  EXPECT_THAT(table, Not(HasSubstr("1.500")));
  EXPECT_THAT(table, HasSubstr("no status received yet"));
}

TEST(WatchLine, HoldsPoseAndCounts) {
  WatchStatistics statistics(std::nullopt);
  statistics.observe(sample(0));
  statistics.observe(sample(2));
  EXPECT_EQ(format_watch_line(statistics),
            "frame 2  tracking  +0.100 -0.200 +1.500 m  sigma 2.1 mm  inliers 380  12.5 Hz  10.0 ms  received 2  missing 1");
}

TEST(WatchSummary, NamesWhatWasReceivedAndMissed) {
  WatchStatistics statistics(std::nullopt);
  for (const int i : {0, 1, 2, 5}) {
    statistics.observe(sample(i));
  }
  EXPECT_THAT(format_watch_summary(statistics),
              HasSubstr("received 4 poses (4 tracked), 1 gaps in sequence (2 missing), over 0.2 s\n"));
}

TEST(WatchCsv, EveryRowHasAsManyCellsAsTheHeader) {
  const auto cells = [](const std::string& row) { return std::count(row.begin(), row.end(), ',') + 1; };
  EXPECT_EQ(cells(watch_csv_row(sample(1))), cells(watch_csv_header()));
  EXPECT_EQ(cells(watch_csv_row(sample(1, TrackingState::Lost))), cells(watch_csv_header()));
}

TEST(WatchCsv, ARowWithoutPoseHasEmptyCells) {
  EXPECT_EQ(watch_csv_row(sample(0, TrackingState::Lost)),
            "0,1700000000000000,1000000000000,1000010000000,1000011000000,lost,,,,,,,,,,1000,400,380,1\n");
}

}  // namespace
}  // namespace posed
