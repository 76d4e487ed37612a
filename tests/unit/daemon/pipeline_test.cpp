#include "daemon/pipeline.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <numeric>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <posed/pose_t.hpp>
#include <posed/status_t.hpp>

#include "core/thread.h"
#include "tests/unit/daemon/fake_gpio_lines.h"
#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

namespace posed {
namespace {

constexpr TimeNs kLong = 60 * kNsPerSecond;  // a limit for what must happen, however slow the machine

/// A pipeline of stand-ins and what came out of it.
class PipelineTest : public ::testing::Test {
 protected:
  PipelineTest() {
    config_.publisher.channel_prefix = "T_";
    config_.pipeline.frame_queue = 2;
    config_.pipeline.frame_slots = 8;
  }

  std::unique_ptr<App> make(FakeSource::Script script, Pacing pacing, Status source_start = {}) {
    config_.source.pacing = pacing;
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>(std::move(script), std::move(source_start));
    parts.tracker = std::exchange(tracker_, nullptr);
    parts.mapper = std::exchange(mapper_, nullptr);
    parts.transport = std::make_unique<FakeTransport>(log_);
    AppOptions options;
    options.on_estimate = [this](const PoseEstimate& estimate) { estimates_.push_back(estimate); };
    options.gpio = gpio_;
    options.on_source_error = [this](const Error&) { source_errors_++; };
    Result<std::unique_ptr<App>> app = make_pipeline(config_, std::move(options), SystemClock::instance(), std::move(parts));
    EXPECT_TRUE(app) << (app ? "" : app.error().message);
    return app ? std::move(*app) : nullptr;
  }

  std::vector<std::uint64_t> sequences() const {
    std::vector<std::uint64_t> result;
    std::transform(estimates_.begin(), estimates_.end(), std::back_inserter(result),
                   [](const PoseEstimate& e) { return e.sequence; });
    return result;
  }

  static std::vector<std::uint64_t> counting(std::uint64_t n) {
    std::vector<std::uint64_t> result(n);
    std::iota(result.begin(), result.end(), 0U);
    return result;
  }

  Config config_;
  std::unique_ptr<FakeTracker> tracker_ = std::make_unique<FakeTracker>();
  std::unique_ptr<FakeMapper> mapper_ = std::make_unique<FakeMapper>();
  std::shared_ptr<TransportLog> log_ = std::make_shared<TransportLog>();
  std::vector<PoseEstimate> estimates_;  // written by the publisher thread, read after it has drained
  std::atomic<int> source_errors_{0};
  const GpioLines* gpio_ = nullptr;
};

TEST_F(PipelineTest, LockstepPublishesEveryFrameInOrder) {
  config_.pipeline.publish_queue = 1;  // the tracking thread must wait for the publisher again and again
  const auto app = make(FakeSource::recording(300), Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), counting(300));
  const std::vector<pose_t> published = log_->decoded<pose_t>("T_POSE");
  ASSERT_EQ(published.size(), 300U);
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(published[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_GE(published[i].publish_mono_ns, published[i].capture_mono_ns);
  }

  const HealthReport health = app->health();
  EXPECT_TRUE(health.source_ended);
  EXPECT_FALSE(health.source_failed);
  EXPECT_EQ(health.frames_captured, 300U);
  EXPECT_EQ(health.frames_tracked, 300U);
  EXPECT_EQ(health.frames_dropped + health.frames_no_slot + health.poses_dropped, 0U);
  EXPECT_EQ(health.poses_published, 300U);
  EXPECT_EQ(health.keyframes, 60U);
  EXPECT_EQ(health.map_keyframes, 60U);
  EXPECT_EQ(health.map_landmarks, 420U);
  EXPECT_EQ(health.track.count, 300U);
  EXPECT_EQ(health.latency.count, 300U);
  EXPECT_EQ(health.map.count, 60U);
  EXPECT_GT(health.peak_rss_bytes, 0U);
}

TEST_F(PipelineTest, LockstepMapsAKeyframeBeforeTheNextFrame) {
  const auto app = make(FakeSource::recording(23), Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  for (const PoseEstimate& estimate : estimates_) {
    EXPECT_EQ(estimate.map_version, (estimate.sequence + 4) / 5) << estimate.sequence;  // keyframes among the frames before it
  }
}

TEST_F(PipelineTest, LockstepRunsOnOneThreadButForThePublisher) {
  std::string tracking;
  std::string mapping;
  std::string capturing;
  tracker_->on_frame = [&](const RgbdFrame&) { tracking = current_thread_name(); };
  mapper_->on_insert = [&] { mapping = current_thread_name(); };
  const auto app = make(
      [&](std::uint64_t call) {
        capturing = current_thread_name();
        return FakeSource::recording(3)(call);
      },
      Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(tracking, "tracker");
  EXPECT_EQ(mapping, "tracker");
  EXPECT_EQ(capturing, "tracker");
}

TEST_F(PipelineTest, RealtimeGivesEveryStageItsThread) {
  std::string tracking;
  std::string mapping;
  std::string capturing;
  tracker_->on_frame = [&](const RgbdFrame&) { tracking = current_thread_name(); };
  mapper_->on_insert = [&] { mapping = current_thread_name(); };
  const auto app = make(
      [&](std::uint64_t call) {
        capturing = current_thread_name();
        return FakeSource::recording(1)(call);
      },
      Pacing::Realtime);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(tracking, "tracker");
  EXPECT_EQ(mapping, "mapper");
  EXPECT_EQ(capturing, "capture");
  EXPECT_EQ(app->health().map_keyframes, 1U);
}

TEST_F(PipelineTest, RealtimeDropsTheOldestFramesWhileTheTrackerIsBusy) {
  std::binary_semaphore tracking{0};
  std::binary_semaphore all_captured{0};
  tracker_->on_frame = [&](const RgbdFrame& frame) {
    if (frame.sequence == 0) {
      tracking.release();
      all_captured.acquire();
    }
  };
  const auto app = make(
      [&](std::uint64_t call) {
        if (call == 1) {
          tracking.acquire();  // frame 0 has left the queue
        }
        if (call == 10) {
          all_captured.release();
          return CaptureKind::EndOfStream;
        }
        return CaptureKind::Frame;
      },
      Pacing::Realtime);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), (std::vector<std::uint64_t>{0, 8, 9}));
  EXPECT_EQ(app->health().frames_captured, 10U);
  EXPECT_EQ(app->health().frames_dropped, 7U);
  EXPECT_EQ(app->health().frames_tracked, 3U);
}

TEST_F(PipelineTest, RealtimeTracksOnWhileTheMapperIsBehind) {
  constexpr int kKeyframeQueue = 2;
  config_.pipeline.keyframe_queue = kKeyframeQueue;
  tracker_->keyframe_interval = 1;
  std::binary_semaphore mapping{0};
  std::binary_semaphore all_tracked{0};
  std::counting_semaphore<> tracked{0};
  mapper_->on_insert = [&, first = true]() mutable {
    if (std::exchange(first, false)) {
      mapping.release();
      all_tracked.acquire();
    }
  };
  tracker_->on_frame = [&](const RgbdFrame& frame) {
    if (frame.sequence == 1) {
      mapping.acquire();  // the mapper is inside of its first keyframe
    }
    tracked.release();
  };
  const auto app = make(
      [&](std::uint64_t call) {
        if (call > 0) {
          tracked.acquire();  // one frame at a time
        }
        if (call == 6) {
          all_tracked.release();
          return CaptureKind::EndOfStream;
        }
        return CaptureKind::Frame;
      },
      Pacing::Realtime);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), counting(6));
  // The cell of the keyframe being mapped is taken until the mapper is done with it.
  EXPECT_EQ(app->health().keyframes, 2U);
  EXPECT_EQ(app->health().keyframes_delayed, 4U);
  EXPECT_EQ(app->health().map_keyframes, 2U);
}

TEST_F(PipelineTest, CountsLostFramesAndTellsSubscribers) {
  tracker_->state = [](std::uint64_t sequence) { return sequence < 4 ? TrackingState::Tracking : TrackingState::Lost; };
  const auto app = make(FakeSource::recording(10), Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(app->health().state, TrackingState::Lost);
  EXPECT_EQ(app->health().frames_tracked, 4U);
  EXPECT_EQ(app->health().frames_lost, 6U);
  const std::vector<pose_t> published = log_->decoded<pose_t>("T_POSE");
  ASSERT_EQ(published.size(), 10U);
  EXPECT_EQ(std::count_if(published.begin(), published.end(), [](const pose_t& m) { return m.has_pose != 0; }), 4);
}

TEST_F(PipelineTest, CountsWhatTheSourceCouldNotDeliver) {
  const auto app = make(
      [](std::uint64_t call) {
        constexpr std::array kScript = {CaptureKind::Frame,      CaptureKind::SkippedFrame, CaptureKind::SkippedFrame,
                                        CaptureKind::NoFreeSlot, CaptureKind::Frame,        CaptureKind::EndOfStream};
        return kScript.at(call);
      },
      Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), counting(2));
  EXPECT_EQ(app->health().frames_captured, 2U);
  EXPECT_EQ(app->health().frames_skipped, 2U);
  EXPECT_EQ(app->health().frames_no_slot, 1U);
  EXPECT_EQ(source_errors_, 2);
}

TEST_F(PipelineTest, AFailingSourceLeavesThePipelineUp) {
  for (const Pacing pacing : {Pacing::Realtime, Pacing::Lockstep}) {
    tracker_ = std::make_unique<FakeTracker>();
    mapper_ = std::make_unique<FakeMapper>();
    source_errors_ = 0;
    const auto app = make([](std::uint64_t call) { return call == 0 ? CaptureKind::Frame : CaptureKind::Failed; }, pacing);
    ASSERT_TRUE(app->start());
    ASSERT_TRUE(app->wait_finished(kLong));
    const HealthReport health = app->health();
    EXPECT_TRUE(health.source_failed);
    EXPECT_FALSE(health.source_ended);
    EXPECT_EQ(health.state, TrackingState::Tracking);  // of the last frame
    EXPECT_EQ(health.frames_tracked, 1U);
    EXPECT_EQ(source_errors_, 1);
    app->stop();
    EXPECT_EQ(log_->decoded<status_t>("T_STATUS").back().source_failed, 1);
  }
}

TEST_F(PipelineTest, ASourceThatCannotStartIsAStateNotAnExit) {
  const auto app = make(FakeSource::recording(5), Pacing::Realtime, make_error(ErrorCode::Unavailable, "unplugged"));
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  EXPECT_TRUE(app->health().source_failed);
  EXPECT_EQ(app->health().frames_captured, 0U);
  EXPECT_EQ(source_errors_, 1);
}

TEST_F(PipelineTest, StopsInEveryState) {
  for (const Pacing pacing : {Pacing::Realtime, Pacing::Lockstep}) {
    for (const std::uint64_t frames_before_silence : {0U, 1U, 50U}) {
      tracker_ = std::make_unique<FakeTracker>();
      mapper_ = std::make_unique<FakeMapper>();
      const auto app = make(
          [=](std::uint64_t call) { return call < frames_before_silence ? CaptureKind::Frame : CaptureKind::Stopped; }, pacing);
      ASSERT_TRUE(app->start());
      EXPECT_FALSE(app->wait_finished(0));
      app->stop();
      app->stop();
      EXPECT_FALSE(app->start());  // it runs once
    }
  }
}

TEST_F(PipelineTest, IsDestroyedCleanlyUnstartedAndWhileRunning) {
  make(FakeSource::recording(1), Pacing::Realtime).reset();
  tracker_ = std::make_unique<FakeTracker>();
  mapper_ = std::make_unique<FakeMapper>();
  std::atomic<bool> busy{false};
  tracker_->on_frame = [&](const RgbdFrame&) { busy = true; };
  const auto app = make([](std::uint64_t) { return CaptureKind::Frame; }, Pacing::Realtime);  // endless: frames wait in the queue
  ASSERT_TRUE(app->start());
  while (!busy) {
    std::this_thread::yield();
  }
}

TEST_F(PipelineTest, KeepsTheKeyframePosesAfterTheStop) {
  const auto app = make(FakeSource::recording(6), Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_TRUE(app->keyframe_pose(2));
  EXPECT_FALSE(app->keyframe_pose(3));
}

TEST_F(PipelineTest, SurvivesATransportThatNeverStarts) {
  log_->opens_to_refuse = 1'000'000;
  const auto app = make(FakeSource::recording(20), Pacing::Lockstep);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), counting(20));
  EXPECT_EQ(app->health().poses_published, 0U);
  EXPECT_GE(app->health().publish_errors, 20U);
  EXPECT_FALSE(app->health().transport_up);
}

TEST_F(PipelineTest, RefusesQueuesThatHaveNoPlace) {
  const auto refused = [&] {
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>(FakeSource::recording(1));
    parts.tracker = std::make_unique<FakeTracker>();
    parts.mapper = std::make_unique<FakeMapper>();
    const Result<std::unique_ptr<App>> app = make_pipeline(config_, {}, SystemClock::instance(), std::move(parts));
    return app ? std::string() : app.error().message;
  };
  config_.pipeline.frame_slots = 5;
  config_.pipeline.frame_queue = 4;
  EXPECT_NE(refused().find("at least 6"), std::string::npos);
  config_.pipeline.frame_slots = 6;
  EXPECT_EQ(refused(), "");
  config_.pipeline.keyframe_queue = 0;
  EXPECT_NE(refused().find("keyframe_queue"), std::string::npos);
}

TEST_F(PipelineTest, NoPosesAreMadeWhilePaused) {
  std::atomic<bool> ended{false};
  FakeGpioLines gpio;
  gpio.report.trigger_pulses = 77;
  gpio_ = &gpio;
  const auto app = make(
      [&](std::uint64_t) {
        std::this_thread::sleep_for(std::chrono::microseconds(500));
        return ended ? CaptureKind::EndOfStream : CaptureKind::Frame;
      },
      Pacing::Realtime);
  const auto reaches = [&](auto condition) {
    for (const TimeNs end_ns = SystemClock::instance().now_ns() + kLong; SystemClock::instance().now_ns() < end_ns;) {
      if (condition(app->health())) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  };
  const auto is_drained = [](const HealthReport& health) {
    return health.frames_paused > 0 &&
           health.frames_captured == health.frames_paused + health.frames_dropped + health.poses_published + health.poses_dropped;
  };
  ASSERT_TRUE(app->start());
  EXPECT_TRUE(reaches([](const HealthReport& health) { return health.poses_published >= 10; }));
  app->set_paused(true);
  EXPECT_TRUE(app->health().paused);
  ASSERT_TRUE(reaches(is_drained));
  const HealthReport paused = app->health();
  EXPECT_TRUE(reaches([&](const HealthReport& health) { return health.frames_paused >= paused.frames_paused + 50; }));
  EXPECT_EQ(app->health().poses_published, paused.poses_published);
  EXPECT_EQ(app->health().frames_tracked, paused.frames_tracked);

  app->set_paused(false);
  EXPECT_TRUE(reaches([&](const HealthReport& health) { return health.poses_published >= paused.poses_published + 10; }));
  EXPECT_FALSE(app->health().paused);
  EXPECT_EQ(app->health().gpio.trigger_pulses, 77U);
  ended = true;
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(app->health().frames_missed, 0U);
  EXPECT_EQ(log_->decoded<status_t>("T_STATUS").back().trigger_pulses, 77);
}

TEST_F(PipelineTest, LockstepIsNeverPaused) {
  const auto app = make(FakeSource::recording(50), Pacing::Lockstep);
  app->set_paused(true);
  EXPECT_FALSE(app->health().paused);
  ASSERT_TRUE(app->start());
  ASSERT_TRUE(app->wait_finished(kLong));
  app->stop();
  EXPECT_EQ(sequences(), counting(50));
  EXPECT_EQ(app->health().frames_paused, 0U);
}

}  // namespace
}  // namespace posed
