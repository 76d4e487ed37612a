// The pipeline's own part of the real-time rule: once they run, the capture and the tracking thread neither touch the heap nor take
// a lock. (tests/system/hot_path_test.cpp shows the same of the whole tracker.)
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "daemon/pipeline.h"
#include "tests/support/hot_path_monitor.h"
#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

namespace posed {
namespace {

constexpr std::uint64_t kWarmUpFrames = 50;
constexpr std::uint64_t kCountedFrames = 500;
constexpr std::uint64_t kBurst = 5;

class RealtimeTest : public ::testing::Test {
 protected:
  /// Runs the pipeline over stand-ins, counting after the warm-up.
  void run() {
    Config config;
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>([this](std::uint64_t call) {
      // In bursts, which overflow the queue, but never so far ahead that the tracker would see next to nothing.
      while (call % kBurst == 0 && newest_tracked_.load() + 1 < call) {
        std::this_thread::yield();
      }
      if (call == kWarmUpFrames) {
        test::watch_hot_path({"capture", "tracker"});
      } else if (call == kWarmUpFrames + kCountedFrames) {
        counts_ = test::hot_path_counts();
      }
      return FakeSource::recording(kWarmUpFrames + kCountedFrames + 1)(call);
    });
    auto tracker = std::make_unique<FakeTracker>();
    tracker->keyframe_interval = 1;  // of the frames that get through, whichever they are
    tracker->on_frame = [this](const RgbdFrame& frame) {
      during_tracking_(frame);
      newest_tracked_ = frame.sequence;
    };
    parts.tracker = std::move(tracker);
    parts.mapper = std::make_unique<FakeMapper>();
    parts.transport = std::make_unique<FakeTransport>(std::make_shared<TransportLog>());
    AppOptions options;
    options.on_estimate = [this](const PoseEstimate&) { published_++; };
    const Result<std::unique_ptr<App>> app = make_pipeline(config, std::move(options), SystemClock::instance(), std::move(parts));
    ASSERT_TRUE(app);
    ASSERT_TRUE((*app)->start());
    ASSERT_TRUE((*app)->wait_finished(60 * kNsPerSecond));
    (*app)->stop();
    EXPECT_EQ((*app)->health().frames_captured, kWarmUpFrames + kCountedFrames + 1);
    EXPECT_GE((*app)->health().frames_tracked, (kWarmUpFrames + kCountedFrames) / kBurst);
    EXPECT_GE((*app)->health().keyframes, 2U);
    EXPECT_EQ(published_ + (*app)->health().poses_dropped, (*app)->health().frames_tracked);
  }

  std::function<void(const RgbdFrame&)> during_tracking_ = [](const RgbdFrame&) {};
  std::atomic<std::uint64_t> newest_tracked_{0};
  std::uint64_t published_ = 0;
  test::HotPathCounts counts_;
};

TEST_F(RealtimeTest, CaptureAndTrackingNeitherAllocateNorLock) {
  run();
  EXPECT_EQ(counts_.allocations, 0) << counts_.first_stack;
  EXPECT_EQ(counts_.locks, 0) << counts_.first_stack;
  EXPECT_EQ(counts_.blocking_calls, 0) << counts_.first_stack;
}

TEST_F(RealtimeTest, TheCountsWouldShowIt) {
  auto mutex = std::make_shared<std::mutex>();
  during_tracking_ = [mutex](const RgbdFrame& frame) {
    if (frame.sequence > kWarmUpFrames) {
      const std::lock_guard lock(*mutex);
      const std::string too_long_for_the_stack(1000 + frame.sequence % 2, ' ');
    }
  };
  run();
  EXPECT_GT(counts_.allocations, 0);
  EXPECT_GT(counts_.locks, 0);
}

}  // namespace
}  // namespace posed
