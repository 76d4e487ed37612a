#include "config/config_reload.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(ConfigReload, TakesLiveKeysAndNamesTheOthers) {
  Config running;
  Config fresh;
  fresh.logging.level = "debug";
  fresh.publisher.status_period_s = 0.25;
  fresh.map.save_period_s = 7;
  fresh.tracker.features = 777;
  fresh.source.kind = SourceKind::Replay;
  const ReloadOutcome outcome = take_live_values(fresh, running);
  EXPECT_EQ(outcome.taken, (std::vector<std::string>{"map.save_period_s", "publisher.status_period_s", "logging.level"}));
  EXPECT_EQ(outcome.refused, (std::vector<std::string>{"source.kind", "tracker.features"}));
  EXPECT_EQ(running.logging.level, "debug");
  EXPECT_EQ(running.publisher.status_period_s, 0.25);
  EXPECT_EQ(running.map.save_period_s, 7);
  EXPECT_EQ(running.tracker.features, Config{}.tracker.features);
  EXPECT_EQ(running.source.kind, Config{}.source.kind);
}

TEST(ConfigReload, TheSameChangesNothing) {
  Config running;
  const ReloadOutcome outcome = take_live_values(running, running);
  EXPECT_TRUE(outcome.taken.empty());
  EXPECT_TRUE(outcome.refused.empty());
}

TEST(ConfigReload, ACalibrationThatWasWrittenAnewNeedsARestart) {
  Config running;
  Config fresh;
  fresh.intrinsics.fx += 1;
  EXPECT_EQ(take_live_values(fresh, running).refused, (std::vector<std::string>{"camera.calibration"}));
}

}  // namespace
}  // namespace posed
