#include <atomic>
#include <cstdlib>
#include <mutex>
#include <time.h>

#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "core/thread.h"
#include "daemon/app.h"
#include "tests/support/hot_path_monitor.h"

namespace posed {
namespace {

TEST(HotPathMonitor, SeesAllocationsLocksAndBlockingCalls) {
  std::mutex mutex;
  const auto misbehave = [&](const char* name) {
    NamedThread thread({.name = name}, [&](const std::stop_token&) {
      void* volatile p = std::malloc(100);
      std::free(p);
      const std::lock_guard lock(mutex);
      const timespec moment{0, 1000};
      nanosleep(&moment, nullptr);
    });
    thread.join();
  };
  test::watch_hot_path({"watched"});
  misbehave("another");
  test::HotPathCounts counts = test::hot_path_counts();
  EXPECT_EQ(counts.allocations + counts.locks, 0);
  test::watch_hot_path({"watched"});
  misbehave("watched");
  counts = test::hot_path_counts();
  EXPECT_GE(counts.allocations, 2);
  EXPECT_GE(counts.locks, 1);
  EXPECT_GE(counts.blocking_calls, 1);
  EXPECT_FALSE(counts.first_stack.empty());
}

/// The daemon's own pipeline, in real time, with people walking through the picture.
TEST(HotPath, TrackingThreadNeitherAllocatesNorLocksNorBlocks) {
  Result<Config> config = default_config();
  ASSERT_TRUE(config) << config.error().message;
  config->source.synthetic.duration_s = 60;  // as long as a busy machine may need; it ends with the last frame

  constexpr std::uint64_t kWarmUpFrames = 30;
  constexpr std::uint64_t kLastFrame = 130;
  std::atomic<std::uint64_t> estimates = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t with_pose = 0;
  AppOptions options;
  options.publish = false;
  test::HotPathCounts counts;
  options.on_estimate = [&](const PoseEstimate& estimate) {  // on the publisher's thread
    const std::uint64_t number = estimates + 1;
    if (number == kWarmUpFrames) {
      test::watch_hot_path({"tracker"});
    } else if (number == kLastFrame) {
      counts = test::hot_path_counts();
    } else if (number > kWarmUpFrames && number < kLastFrame) {
      keyframes += estimate.keyframe ? 1 : 0;
      with_pose += estimate.has_pose() ? 1 : 0;
    }
    estimates = number;  // when all is counted: what waits for the last one takes the threads down
  };
  Result<std::unique_ptr<App>> app = App::create(*config, options, SystemClock::instance());
  ASSERT_TRUE(app) << app.error().message;
  ASSERT_TRUE((*app)->start());
  while (estimates < kLastFrame && !(*app)->wait_finished(50 * kNsPerMs)) {
  }
  (*app)->stop();

  ASSERT_GE(estimates, kLastFrame) << "the machine was too busy to render enough frames";
  ASSERT_GT(with_pose, 30U) << "too little was tracked to show anything";
  ASSERT_GT(keyframes, 0U) << "handing a keyframe on is part of what is tested";
  EXPECT_EQ(counts.allocations, 0) << "first called from\n" << counts.first_stack;
  EXPECT_EQ(counts.locks, 0) << "first called from\n" << counts.first_stack;
  EXPECT_EQ(counts.blocking_calls, 0) << "first called from\n" << counts.first_stack;
}

}  // namespace
}  // namespace posed
