#include "drivers/camera_source.h"

#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/frame_pool.h"
#include "drivers/frame_guard.h"
#include "tests/support/stepping_clock.h"

namespace posed {
namespace {

constexpr TimeNs kPeriod_ns = 33 * kNsPerMs;
constexpr TimeNs kDelay_ns = 5 * kNsPerMs;  // from the capture to the delivery

/// The device behind the camera, as a test moves it.
struct FakeDevice {
  TimeNs away_until_ns = 0;
  TimeNs silent_until_ns = 0;
  std::function<void()> on_open;
  bool open = false;
  int opened = 0;
  std::deque<CameraRead> faults;  // what the next reads give instead of frames
  std::uint64_t sequence = 0;
  TimeNs stamp_offset_ns = 0;
  bool frozen = false;  // it repeats its image
  int frames_let_go = 0;
};

/// 30 frames a second by the clock.
class FakeCamera final : public Camera {
 public:
  FakeCamera(FakeDevice& device, SteppingClock& clock) : device_(device), clock_(clock) {}

  const std::string& description() const override { return description_; }

  Status open() override {
    EXPECT_FALSE(device_.open);
    if (device_.on_open) {
      device_.on_open();
    }
    if (away()) {
      return make_error(ErrorCode::NotFound, "no camera there");
    }
    ++device_.opened;
    device_.open = true;
    return {};
  }

  CameraRead read(RgbdFrame* frame, TimeNs timeout_ns) override {
    EXPECT_TRUE(device_.open);
    if (away()) {
      return {CameraReadKind::Gone, {ErrorCode::Unavailable, "the camera was unplugged"}};
    }
    if (!device_.faults.empty()) {
      CameraRead fault = device_.faults.front();
      device_.faults.pop_front();
      ++device_.sequence;
      return fault;
    }
    if (clock_.now_ns() < device_.silent_until_ns) {
      clock_.advance(timeout_ns);
      return {};
    }
    clock_.advance(kPeriod_ns);
    if (frame == nullptr) {
      ++device_.frames_let_go;
      ++device_.sequence;
      return {CameraReadKind::Frame, {}};
    }
    frame->gray.at(0, 0) = device_.frozen ? 255 : static_cast<std::uint8_t>(device_.sequence % 255);
    frame->depth_m.at(0, 0) = 1.0F;
    frame->sequence = device_.sequence++;
    frame->capture_ns = clock_.now_ns() - kDelay_ns + device_.stamp_offset_ns;
    return {CameraReadKind::Frame, {}};
  }

  void close() noexcept override { device_.open = false; }
  const CameraMetrics& metrics() const override { return metrics_; }

 private:
  bool away() const { return clock_.now_ns() < device_.away_until_ns; }

  FakeDevice& device_;
  SteppingClock& clock_;
  std::string description_ = "fake camera";
  CameraMetrics metrics_;
};

class CameraSourceTest : public testing::Test {
 protected:
  CameraSourceTest() { restart({.width = 8, .height = 8, .live = {}, .pacing = Pacing::Realtime}); }

  void restart(const CameraSourceOptions& options) {
    source_ = make_camera_source(std::make_unique<FakeCamera>(device_, clock_), options, clock_);
    ASSERT_TRUE(source_->start(pool_));
  }

  Capture next() { return source_->next(stop_.get_token()); }

  std::uint64_t next_sequence() {
    const Capture capture = next();
    EXPECT_EQ(capture.kind, CaptureKind::Frame) << capture.error.message;
    return capture.frame ? capture.frame->sequence : 0;
  }

  SteppingClock clock_;
  FakeDevice device_;
  FramePool pool_{8, 8, 3};
  std::stop_source stop_;
  std::unique_ptr<RgbdSource> source_;
};

TEST_F(CameraSourceTest, DeliversFramesWithStampsAndItsOwnCount) {
  device_.sequence = 700;
  const Capture first = next();
  ASSERT_EQ(first.kind, CaptureKind::Frame);
  EXPECT_EQ(first.frame->sequence, 0U);
  EXPECT_EQ(first.frame->capture_ns, clock_.now_ns() - kDelay_ns);
  EXPECT_EQ(first.frame->stamp_utc_ns, clock_.utc_ns(first.frame->capture_ns));
  EXPECT_EQ(next_sequence(), 1U);
  device_.sequence += 3;  // lost by the device
  EXPECT_EQ(next_sequence(), 5U);
  EXPECT_TRUE(source_->health().connected);
  EXPECT_EQ(source_->health().reconnects, 0U);
}

TEST_F(CameraSourceTest, StartsWithoutItsCameraAndWaits) {
  device_.away_until_ns = clock_.now_ns() + 100 * kNsPerSecond;
  const Capture capture = next();
  EXPECT_EQ(capture.kind, CaptureKind::Interrupted);
  EXPECT_EQ(capture.error.message, "no camera there");
  EXPECT_FALSE(source_->health().connected);
  EXPECT_EQ(next_sequence(), 0U) << "the same reason is told once";
  EXPECT_TRUE(source_->health().connected);
  EXPECT_EQ(source_->health().reconnects, 0U) << "it was never there before";
}

TEST_F(CameraSourceTest, FramesComeAgainWithinTwoSecondsOfTheCamerasReturn) {
  std::uint64_t sequence = next_sequence();
  for (const TimeNs away_ns : {100 * kNsPerMs, 5 * kNsPerSecond, 600 * kNsPerSecond}) {
    device_.away_until_ns = clock_.now_ns() + away_ns;
    const Capture lost = next();
    EXPECT_EQ(lost.kind, CaptureKind::Interrupted);
    EXPECT_EQ(lost.error.message, "the camera was unplugged");
    EXPECT_FALSE(device_.open);
    EXPECT_FALSE(source_->health().connected);
    if (away_ns > 50 * kNsPerMs) {
      EXPECT_EQ(next().error.message, "no camera there");
    }
    EXPECT_EQ(next_sequence(), ++sequence);
    EXPECT_LT(clock_.now_ns() - device_.away_until_ns, 2 * kNsPerSecond);
  }
  EXPECT_EQ(source_->health().reconnects, 3U);
  EXPECT_EQ(source_->health().stalls, 0U);
}

TEST_F(CameraSourceTest, AttemptsBecomeRarer) {
  next_sequence();
  device_.away_until_ns = clock_.now_ns() + 60 * kNsPerSecond;
  int attempts = 0;
  device_.on_open = [&] { ++attempts; };
  EXPECT_EQ(next().kind, CaptureKind::Interrupted);
  EXPECT_EQ(next().kind, CaptureKind::Interrupted);
  next_sequence();
  EXPECT_GE(attempts, 60);
  EXPECT_LE(attempts, 60 + 6) << "one a second, but for the first few";
}

TEST_F(CameraSourceTest, ASilentCameraIsOpenedAgain) {
  next_sequence();
  device_.silent_until_ns = clock_.now_ns() + 5 * kNsPerSecond;
  const Capture silent = next();
  EXPECT_EQ(silent.kind, CaptureKind::Interrupted);
  EXPECT_EQ(silent.error.message, "fake camera: no frame for 1.0 s; it is opened again");
  EXPECT_EQ(next_sequence(), 1U);
  EXPECT_LT(clock_.now_ns() - device_.silent_until_ns, 2 * kNsPerSecond);
  EXPECT_EQ(source_->health().reconnects, 1U);
  EXPECT_GE(source_->health().stalls, 2U);
  EXPECT_GE(device_.opened, 3);
}

TEST_F(CameraSourceTest, BadFramesAreLeftOutAndExplainTheGap) {
  next_sequence();
  device_.faults = {{CameraReadKind::BadFrame, {ErrorCode::BadData, "half a frame"}}};
  const Capture bad = next();
  EXPECT_EQ(bad.kind, CaptureKind::SkippedFrame);
  EXPECT_EQ(bad.error.message, "half a frame");
  EXPECT_EQ(next_sequence(), 2U);
  EXPECT_TRUE(source_->health().connected);
}

TEST_F(CameraSourceTest, StampsAlwaysIncrease) {
  next_sequence();
  device_.stamp_offset_ns = -2 * kPeriod_ns;
  const Capture back = next();
  EXPECT_EQ(back.kind, CaptureKind::SkippedFrame);
  EXPECT_EQ(back.error.message, "a frame's stamp is 0.033000 s before that of the frame before it");
  device_.stamp_offset_ns = kNsPerSecond;
  EXPECT_EQ(next().error.message, "a frame's stamp is 0.995 s in the future");
  device_.stamp_offset_ns = 0;
  Capture frame = next();
  ASSERT_EQ(frame.kind, CaptureKind::Frame);
  const std::int64_t utc_ns = frame.frame->stamp_utc_ns;
  clock_.set_utc_of_zero(0);  // UTC was set back
  frame = next();
  ASSERT_EQ(frame.kind, CaptureKind::Frame);
  EXPECT_EQ(frame.frame->stamp_utc_ns, utc_ns + 1);
}

TEST_F(CameraSourceTest, AFrozenImageIsLeftOutUntilItMovesOrTheCameraIsOpenedAgain) {
  next_sequence();
  device_.frozen = true;
  for (int i = 0; i < 1 + FrameGuard::kRepeatsAllowed; ++i) {
    next_sequence();
  }
  EXPECT_EQ(next().error.message, "the camera repeats one image, 3 times so far");
  EXPECT_EQ(next().kind, CaptureKind::SkippedFrame);
  device_.frozen = false;
  EXPECT_EQ(next().kind, CaptureKind::Frame);
  device_.frozen = true;
  for (int i = 0; i < 1 + FrameGuard::kRepeatsAllowed; ++i) {
    EXPECT_EQ(next().kind, CaptureKind::Frame);
  }
  device_.faults = {{CameraReadKind::Gone, {ErrorCode::Io, "gone for a moment"}}};
  EXPECT_EQ(next().kind, CaptureKind::Interrupted);
  EXPECT_EQ(next().kind, CaptureKind::Frame);
}

TEST_F(CameraSourceTest, WithoutASlotTheFrameIsLetGo) {
  std::vector<Capture> held;
  for (std::size_t i = 0; i < pool_.slots(); ++i) {
    held.push_back(next());
  }
  EXPECT_EQ(next().kind, CaptureKind::NoFreeSlot);
  EXPECT_EQ(device_.frames_let_go, 1);
  held.clear();
  EXPECT_EQ(next_sequence(), 4U);
}

TEST_F(CameraSourceTest, ARecordingEndsAndIsNeverSilent) {
  restart({.width = 8, .height = 8, .live = {}, .pacing = Pacing::Lockstep});
  device_.silent_until_ns = clock_.now_ns() + 5 * kNsPerSecond;
  next_sequence();
  EXPECT_EQ(source_->health().stalls, 0U);
  device_.faults = {{CameraReadKind::End, {}}};
  EXPECT_EQ(next().kind, CaptureKind::EndOfStream);
}

TEST_F(CameraSourceTest, AStopEndsTheWait) {
  device_.away_until_ns = clock_.now_ns() + 100 * kNsPerSecond;
  EXPECT_EQ(next().kind, CaptureKind::Interrupted);
  const TimeNs asked_ns = clock_.now_ns() + kNsPerSecond;
  device_.on_open = [&] {
    if (clock_.now_ns() > asked_ns) {
      stop_.request_stop();
    }
  };
  EXPECT_EQ(next().kind, CaptureKind::Stopped);
}

TEST_F(CameraSourceTest, ClosesItsCamera) {
  next_sequence();
  EXPECT_TRUE(device_.open);
  source_.reset();
  EXPECT_FALSE(device_.open);
}

TEST_F(CameraSourceTest, APoolOfAnotherSizeIsRefused) {
  FramePool other(16, 8, 2);
  const Status started = source_->start(other);
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().message, "the frame pool holds 16x8 pixels, the camera delivers 8x8");
}

}  // namespace
}  // namespace posed
