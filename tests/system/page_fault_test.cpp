#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "core/memory_lock.h"
#include "daemon/app.h"

namespace posed {
namespace {

/// The daemon's own pipeline, in real time, with people walking through the picture.
TEST(PageFaults, HotThreadsHaveNoneOnceTheyAreWarmWhereMemoryIsLocked) {
  if (const Status locked = lock_memory(); !locked) {
    GTEST_SKIP() << locked.error().message;
  }
  Result<Config> config = default_config();
  ASSERT_TRUE(config) << config.error().message;
  config->source.synthetic.duration_s = 8;

  constexpr std::uint64_t kWarmUpFrames = 30;
  std::uint64_t estimates = 0;
  HealthReport warm;
  AppOptions options;
  options.publish = false;
  const App* running = nullptr;
  options.on_estimate = [&](const PoseEstimate&) {  // on the publisher's thread
    if (++estimates == kWarmUpFrames) {
      warm = running->health();
    }
  };
  Result<std::unique_ptr<App>> app = App::create(*config, options, SystemClock::instance());
  ASSERT_TRUE(app) << app.error().message;
  running = app->get();
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(60 * kNsPerSecond));
  const HealthReport end = (*app)->health();
  (*app)->stop();

  ASSERT_GT(end.frames_tracked, kWarmUpFrames + 60) << "the machine was too busy to render enough frames";
  ASSERT_GT(warm.tracker_page_faults, 0U) << "they are not counted";
  EXPECT_EQ(end.tracker_page_faults - warm.tracker_page_faults, 0U);
  EXPECT_EQ(end.capture_page_faults - warm.capture_page_faults, 0U);
}

}  // namespace
}  // namespace posed
