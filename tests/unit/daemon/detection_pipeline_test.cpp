#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <semaphore>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <posed/detections_t.hpp>
#include <posed/status_t.hpp>

#include "daemon/pipeline.h"
#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

namespace posed {
namespace {

constexpr TimeNs kLong = 60 * kNsPerSecond;  // a limit for what must happen, however slow the machine

/// Sees as many people as the frame's number tells, modulo 3.
class FakeDetector final : public FrameDetector {
 public:
  std::function<Result<DetectionOutcome>(const RgbdFrame&)> outcome = [](const RgbdFrame&) {
    return DetectionOutcome{true, 1, kNsPerMs, 0, kNsPerMs};
  };

  Result<DetectionOutcome> detect(const RgbdFrame& frame, Detections& found) override { return look(frame, found); }
  Result<DetectionOutcome> detect_unhurried(const RgbdFrame& frame, Detections& found) override {
    ++unhurried;
    return look(frame, found);
  }
  std::string model_name(std::size_t model) const override { return "model-" + std::to_string(model); }

  std::atomic<int> unhurried{0};

 private:
  Result<DetectionOutcome> look(const RgbdFrame& frame, Detections& found) const {
    found.sequence = frame.sequence;
    found.capture_ns = frame.capture_ns;
    found.stamp_utc_ns = frame.stamp_utc_ns;
    found.image_width = 16;
    found.image_height = 8;
    found.assign(std::vector<Detection>(frame.sequence % 3, Detection{{1, 2, 3, 4}, 0.5F}));
    return outcome(frame);
  }
};

class DetectionPipelineTest : public ::testing::Test {
 protected:
  DetectionPipelineTest() {
    config_.publisher.channel_prefix = "T_";
    config_.pipeline.frame_queue = 2;
    config_.pipeline.frame_slots = 8;
  }

  std::unique_ptr<App> make(FakeSource::Script script, Pacing pacing) {
    config_.source.pacing = pacing;
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>(std::move(script));
    auto tracker = std::make_unique<FakeTracker>();
    tracker->on_frame = on_frame_;
    tracker->on_detections = on_known_;
    parts.tracker = std::move(tracker);
    parts.mapper = std::make_unique<FakeMapper>();
    parts.transport = std::make_unique<FakeTransport>(log_);
    parts.detector = std::move(owned_detector_);
    AppOptions options;
    options.on_estimate = [this](const PoseEstimate& e) { estimates_.push_back(e.sequence); };
    options.on_detections = [this](const Detections& d) { looked_at_.push_back(d.sequence); };
    return std::move(make_pipeline(config_, std::move(options), SystemClock::instance(), std::move(parts)).value());
  }

  void run(App& app) {
    ASSERT_TRUE(app.start());
    ASSERT_TRUE(app.wait_finished(kLong));
    app.stop();
  }

  Config config_;
  std::unique_ptr<FakeDetector> owned_detector_ = std::make_unique<FakeDetector>();
  FakeDetector& detector_ = *owned_detector_;
  std::function<void(const RgbdFrame&)> on_frame_ = [](const RgbdFrame&) {};
  std::function<void(const RgbdFrame&, const Detections*)> on_known_ = [](const RgbdFrame&, const Detections*) {};
  std::shared_ptr<TransportLog> log_ = std::make_shared<TransportLog>();
  std::vector<std::uint64_t> estimates_;  // both written by the publisher thread, read after it has drained
  std::vector<std::uint64_t> looked_at_;
};

TEST_F(DetectionPipelineTest, LockstepLooksAtEveryFrameUnhurried) {
  const auto app = make(FakeSource::recording(100), Pacing::Lockstep);
  run(*app);
  ASSERT_EQ(looked_at_.size(), 100U);
  EXPECT_TRUE(std::is_sorted(looked_at_.begin(), looked_at_.end()));
  EXPECT_EQ(detector_.unhurried, 100);
  const auto messages = log_->decoded<detections_t>("T_DETECTIONS");
  ASSERT_EQ(messages.size(), 100U);
  EXPECT_EQ(messages[5].sequence, 5);
  EXPECT_EQ(messages[5].utime, 5'000'000);
  EXPECT_EQ(messages[5].image_width, 16);
  ASSERT_EQ(messages[5].count, 2);
  EXPECT_EQ(messages[5].detections[1].label, "person");
  EXPECT_FLOAT_EQ(messages[5].detections[1].x_max, 3);
  EXPECT_GE(messages[5].publish_mono_ns, messages[5].capture_mono_ns);
  EXPECT_EQ(messages[6].count, 0);
  const HealthReport health = app->health();
  EXPECT_EQ(health.detector_model, "model-1");
  EXPECT_EQ(health.detected, 100U);
  EXPECT_EQ(health.detections_dropped + health.detections_abandoned + health.detector_errors, 0U);
  EXPECT_EQ(log_->decoded<status_t>("T_STATUS").back().detected, 100);
}

TEST_F(DetectionPipelineTest, InLockstepTheTrackerLearnsOfPeopleAFixedNumberOfFramesLate) {
  for (const int lag : {0, 2, 5}) {
    SCOPED_TRACE(lag);
    config_.dynamic.lockstep_lag = lag;
    owned_detector_ = std::make_unique<FakeDetector>();
    std::vector<std::pair<std::uint64_t, std::uint64_t>> known;  // frame, and the one whose people it knows
    int ignorant = 0;
    on_known_ = [&](const RgbdFrame& frame, const Detections* newest) {
      ASSERT_NE(newest, nullptr);
      if (newest->image_width == 0) {
        ++ignorant;
      } else {
        known.emplace_back(frame.sequence, newest->sequence);
      }
    };
    run(*make(FakeSource::recording(30), Pacing::Lockstep));
    EXPECT_EQ(ignorant, lag);
    ASSERT_EQ(known.size(), 30U - static_cast<std::size_t>(lag));
    for (const auto& [frame, looked_at] : known) {
      EXPECT_EQ(frame, looked_at + static_cast<std::uint64_t>(lag));
    }
  }
}

TEST_F(DetectionPipelineTest, InRealTimeTheTrackerGetsTheNewestPeopleKnown) {
  std::atomic<std::uint64_t> newest_known{0};
  on_known_ = [&](const RgbdFrame& frame, const Detections* newest) {
    ASSERT_NE(newest, nullptr);
    EXPECT_LE(newest->sequence, frame.sequence + config_.pipeline.frame_queue + 2) << "of a frame that is not there yet";
    EXPECT_GE(newest->sequence, newest_known.load()) << "older than what was known before";
    newest_known = newest->sequence;
  };
  run(*make(FakeSource::recording(200), Pacing::Realtime));
}

TEST_F(DetectionPipelineTest, ADetectorThatNeverEndsDelaysNobody) {
  config_.pipeline.publish_queue = 256;  // so that none is lost where the publisher's thread waits for a processor
  std::counting_semaphore<> go{0};
  std::atomic<int> frames{0};
  detector_.outcome = [&](const RgbdFrame&) {
    go.acquire();
    return DetectionOutcome{true, 0, kNsPerMs, 0, kNsPerMs};
  };
  on_frame_ = [&](const RgbdFrame& frame) {
    if (++frames == 200) {
      go.release(1000);  // all were tracked while it looked at the first
    }
    EXPECT_LE(frame.sequence, 199U);
  };
  // The source waits for the tracker, so that no frame is dropped for want of speed.
  const auto app = make(
      [&](std::uint64_t call) {
        while (call < 200 && frames.load() < static_cast<int>(call)) {
          std::this_thread::yield();
        }
        return call < 200 ? CaptureKind::Frame : CaptureKind::EndOfStream;
      },
      Pacing::Realtime);
  run(*app);
  EXPECT_EQ(estimates_.size(), 200U);
  ASSERT_FALSE(looked_at_.empty());
  EXPECT_LT(looked_at_.size(), 10U) << "what came meanwhile was passed over";
  EXPECT_EQ(looked_at_.back(), 199U) << "the newest frame was not";
  EXPECT_EQ(app->health().frames_no_slot, 0U) << "it holds few frames";
}

TEST_F(DetectionPipelineTest, FramesGivenUpAndErrorsAreCountedAndNotPublished) {
  detector_.outcome = [](const RgbdFrame& frame) -> Result<DetectionOutcome> {
    if (frame.sequence % 4 == 1) {
      return make_error(ErrorCode::Unavailable, "out of order (fake)");
    }
    return DetectionOutcome{frame.sequence % 4 != 2, 0, 40 * kNsPerMs, 7 * kNsPerMs, kNsPerMs};
  };
  const auto app = make(FakeSource::recording(40), Pacing::Lockstep);
  run(*app);
  EXPECT_EQ(looked_at_.size(), 20U);
  EXPECT_EQ(estimates_.size(), 40U) << "tracking goes on";
  const HealthReport health = app->health();
  EXPECT_EQ(health.detected, 20U);
  EXPECT_EQ(health.detections_abandoned, 10U);
  EXPECT_EQ(health.detector_errors, 10U);
  EXPECT_EQ(health.detect.count, 30U);
  EXPECT_EQ(health.detect_overrun.count, 30U);
  EXPECT_DOUBLE_EQ(health.detect_overrun.max_ms, 7.0);
}

TEST_F(DetectionPipelineTest, StopsWhileTheDetectorWaitsForAFrame) {
  const auto app = make([](std::uint64_t call) { return call < 3 ? CaptureKind::Frame : CaptureKind::Stopped; }, Pacing::Realtime);
  ASSERT_TRUE(app->start());
  app->stop();
  EXPECT_FALSE(app->health().source_ended);
}

TEST_F(DetectionPipelineTest, NeedsRoomForTheFramesItHolds) {
  config_.pipeline.frame_slots = 6;
  PipelineParts parts;
  parts.source = std::make_unique<FakeSource>(FakeSource::recording(1));
  parts.tracker = std::make_unique<FakeTracker>();
  parts.mapper = std::make_unique<FakeMapper>();
  parts.detector = std::make_unique<FakeDetector>();
  const auto app = make_pipeline(config_, {}, SystemClock::instance(), std::move(parts));
  ASSERT_FALSE(app);
  EXPECT_NE(app.error().message.find("at least 7"), std::string::npos) << app.error().message;
}

}  // namespace
}  // namespace posed
