#include "drivers/synthetic_source.h"

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/synthetic_camera.h"

namespace posed {
namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 36;

/// Time that passes only where somebody sleeps, or where the test lets it.
class ManualClock final : public Clock {
 public:
  TimeNs now_ns() const noexcept override { return now_ns_; }
  void sleep_until(TimeNs deadline_ns) const override { now_ns_ = std::max(now_ns_.load(), deadline_ns); }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return monotonic_ns + kUtcOffset_ns; }
  void advance(TimeNs by_ns) { now_ns_ += by_ns; }

  static constexpr std::int64_t kUtcOffset_ns = 1'800'000'000 * kNsPerSecond;

 private:
  mutable std::atomic<TimeNs> now_ns_{5 * kNsPerSecond};
};

class SyntheticSourceTest : public testing::Test {
 protected:
  SyntheticSourceTest() {
    camera_.width = kWidth;
    camera_.height = kHeight;
    camera_.fx = camera_.fy = 40;
    camera_.cx = 23.5;
    camera_.cy = 17.5;
    config_.synthetic.people = 0;
    config_.synthetic.rate_hz = 25;  // 40 ms
  }

  std::unique_ptr<RgbdSource> open() { return std::move(*make_synthetic_source(config_, camera_, clock_)); }

  ManualClock clock_;
  FramePool pool_{kWidth, kHeight, 2};
  SourceConfig config_;
  CameraIntrinsics camera_;
  std::stop_source stop_;
};

TEST_F(SyntheticSourceTest, RealtimeFramesComeWhenDue) {
  config_.synthetic.duration_s = 0.2;
  const auto source = open();
  EXPECT_EQ(source->info().total_frames, 5U);
  const TimeNs opened_ns = clock_.now_ns();
  ASSERT_TRUE(source->start(pool_).has_value());
  for (std::uint64_t i = 0; i < 5; ++i) {
    const Capture capture = source->next(stop_.get_token());
    ASSERT_EQ(capture.kind, CaptureKind::Frame);
    EXPECT_EQ(capture.frame->sequence, i);
    EXPECT_EQ(capture.frame->capture_ns, opened_ns + static_cast<TimeNs>(i + 1) * 40 * kNsPerMs);
    EXPECT_EQ(capture.frame->capture_ns, clock_.now_ns());
    EXPECT_EQ(capture.frame->stamp_utc_ns, capture.frame->capture_ns + ManualClock::kUtcOffset_ns);
    EXPECT_TRUE(capture.frame->T_world_camera_truth.has_value());
  }
  EXPECT_EQ(source->next(stop_.get_token()).kind, CaptureKind::EndOfStream);
}

TEST_F(SyntheticSourceTest, RealtimeLeavesOutWhatHasPassed) {
  const auto source = open();
  ASSERT_TRUE(source->start(pool_).has_value());
  EXPECT_EQ(source->next(stop_.get_token()).frame->sequence, 0U);
  clock_.advance(130 * kNsPerMs);  // past frames 1 (40 ms), 2 and 3 (120 ms)
  const Capture capture = source->next(stop_.get_token());
  ASSERT_EQ(capture.kind, CaptureKind::Frame);
  EXPECT_EQ(capture.frame->sequence, 4U);
  EXPECT_EQ(capture.frame->capture_ns, clock_.now_ns());
}

TEST_F(SyntheticSourceTest, RealtimeLosesFramesWithoutASlot) {
  const auto source = open();
  ASSERT_TRUE(source->start(pool_).has_value());
  std::optional<Capture> first = source->next(stop_.get_token());
  const Capture second = source->next(stop_.get_token());
  const TimeNs before_ns = clock_.now_ns();
  EXPECT_EQ(source->next(stop_.get_token()).kind, CaptureKind::NoFreeSlot);
  EXPECT_EQ(clock_.now_ns(), before_ns + 40 * kNsPerMs) << "the lost frame takes its time too";
  first.reset();
  const Capture fourth = source->next(stop_.get_token());
  ASSERT_EQ(fourth.kind, CaptureKind::Frame);
  EXPECT_EQ(fourth.frame->sequence, 3U);
}

TEST_F(SyntheticSourceTest, LockstepDeliversEveryFrameWithTheRecordingsStamps) {
  config_.pacing = Pacing::Lockstep;
  config_.synthetic.duration_s = 0.12;
  const auto source = open();
  ASSERT_TRUE(source->start(pool_).has_value());
  for (std::uint64_t i = 0; i < 3; ++i) {
    clock_.advance(500 * kNsPerMs);
    const Capture capture = source->next(stop_.get_token());
    ASSERT_EQ(capture.kind, CaptureKind::Frame);
    EXPECT_EQ(capture.frame->sequence, i);
    EXPECT_EQ(capture.frame->capture_ns, clock_.now_ns());
    EXPECT_EQ(capture.frame->stamp_utc_ns, SyntheticCamera::kEpochUtc_ns + static_cast<std::int64_t>(i) * 40 * kNsPerMs);
  }
  EXPECT_EQ(source->next(stop_.get_token()).kind, CaptureKind::EndOfStream);
}

TEST_F(SyntheticSourceTest, LockstepWaitsForASlot) {
  config_.pacing = Pacing::Lockstep;
  const auto source = std::move(*make_synthetic_source(config_, camera_, SystemClock::instance()));
  ASSERT_TRUE(source->start(pool_).has_value());
  std::optional<Capture> first = source->next(stop_.get_token());
  const Capture second = source->next(stop_.get_token());
  std::jthread consumer([&first] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    first.reset();
  });
  const Capture third = source->next(stop_.get_token());
  ASSERT_EQ(third.kind, CaptureKind::Frame);
  EXPECT_EQ(third.frame->sequence, 2U);
}

TEST_F(SyntheticSourceTest, StopsWhileItWaits) {
  for (const Pacing pacing : {Pacing::Realtime, Pacing::Lockstep}) {
    config_.pacing = pacing;
    config_.synthetic.rate_hz = 0.01;  // the next frame is due in 100 s
    const auto source = std::move(*make_synthetic_source(config_, camera_, SystemClock::instance()));
    FramePool pool(kWidth, kHeight, 1);
    const auto held = pool.acquire();  // and there is no slot to wait for either
    ASSERT_TRUE(source->start(pool).has_value());
    std::stop_source stop;
    std::jthread stopper([&stop] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      stop.request_stop();
    });
    EXPECT_EQ(source->next(stop.get_token()).kind, CaptureKind::Stopped);
    EXPECT_EQ(source->next(stop.get_token()).kind, CaptureKind::Stopped) << "a stopped source stays so";
  }
}

TEST_F(SyntheticSourceTest, RefusesAPoolOfAnotherSize) {
  const auto source = open();
  FramePool larger(64, 48, 1);
  const Status status = source->start(larger);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(status.error().message.find("64x48"), std::string::npos);
  EXPECT_EQ(source->next(stop_.get_token()).kind, CaptureKind::Failed);
}

TEST_F(SyntheticSourceTest, RefusesABadConfiguration) {
  config_.synthetic.people = -1;
  const auto source = make_synthetic_source(config_, camera_, clock_);
  ASSERT_FALSE(source.has_value());
  EXPECT_EQ(source.error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace posed
