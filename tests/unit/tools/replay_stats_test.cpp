#include "tools/posectl/replay_stats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace posed {
namespace {

using testing::HasSubstr;

ReplayStats example() {
  ReplayStats stats;
  stats.source = {"replay of \"desk\", 480 frames", 640, 480, 30.0, 480, 4};
  stats.lockstep = true;
  stats.wall_s = 16.5;
  stats.residual_variance = 0.75;
  stats.health.frames_captured = 478;
  stats.health.frames_no_slot = 2;
  stats.health.frames_skipped = 3;
  stats.health.frames_dropped = 4;
  stats.health.frames_tracked = 470;
  stats.health.frames_lost = 4;
  stats.health.keyframes = 12;
  stats.health.track = {.count = 474, .mean_ms = 8.25, .p50_ms = 8, .p95_ms = 9, .p99_ms = 10, .p999_ms = 11, .max_ms = 12};
  stats.health.peak_rss_bytes = 123'000'000;
  return stats;
}

TEST(ReplayStats, JsonHoldsCountersAndQuantiles) {
  const nlohmann::json json = nlohmann::json::parse(to_json(example()));
  EXPECT_EQ(json.at("frames"), 480);
  EXPECT_EQ(json.at("tracked"), 470);
  EXPECT_EQ(json.at("lost"), 4);
  EXPECT_EQ(json.at("dropped"), 6);
  EXPECT_EQ(json.at("skipped"), 3);
  EXPECT_EQ(json.at("residual_variance"), 0.75);
  EXPECT_EQ(json.at("keyframes"), 12);
  EXPECT_EQ(json.at("pacing"), "lockstep");
  EXPECT_EQ(json.at("peak_rss_bytes"), 123'000'000);
  EXPECT_EQ(json.at("source").at("description"), "replay of \"desk\", 480 frames");
  EXPECT_EQ(
      json.at("track_ms"),
      nlohmann::json::parse(R"({"p50": 8.0, "p95": 9.0, "p99": 10.0, "p999": 11.0, "max": 12.0, "mean": 8.25, "count": 474})"));
  for (const char* key : {"latency_ms", "map_ms", "detect_ms", "detect_overrun_ms"}) {
    EXPECT_EQ(json.at(key).at("count"), 0) << key;
  }
  EXPECT_FALSE(json.at("version").get<std::string>().empty());
}

TEST(ReplayStats, EveryDeliveredFrameIsTrackedLostOrDropped) {
  const nlohmann::json json = nlohmann::json::parse(to_json(example()));
  EXPECT_EQ(json.at("frames").get<int>(),
            json.at("tracked").get<int>() + json.at("lost").get<int>() + json.at("dropped").get<int>());
}

TEST(ReplayStats, JsonSurvivesAPathThatIsNotUtf8) {
  ReplayStats stats = example();
  stats.source.description = "replay of \xff\xfe";
  EXPECT_FALSE(nlohmann::json::parse(to_json(stats), nullptr, false).is_discarded());
}

TEST(ReplayStats, SummaryNamesSharesAndInterruption) {
  ReplayStats stats = example();
  stats.interrupted = true;
  const std::string summary = format_replay_summary(stats);
  EXPECT_THAT(summary, HasSubstr("(interrupted)"));
  EXPECT_THAT(summary, HasSubstr("480: tracked 470 (97.9 %), lost 4, dropped 6; skipped 3"));
  EXPECT_THAT(summary, HasSubstr("p50 8.00  p95 9.00  p99 10.00  p99.9 11.00  max 12.00  (474 measured)"));
}

TEST(ReplayStats, SummaryOfNothingDividesByNothing) {
  EXPECT_THAT(format_replay_summary({}), HasSubstr("tracked 0 (0.0 %)"));
}

}  // namespace
}  // namespace posed
