#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <utility>

#include "drivers/rgbd_source.h"
#include "tests/support/test_recording.h"

namespace posed {

/// A source that delivers `frames` painted frames (test_recording.h) as fast as it is asked. In lockstep it waits for slots;
/// otherwise it drops the frame, as a camera does. Endless where `frames` is 0.
class PaintedSource final : public RgbdSource {
 public:
  explicit PaintedSource(std::uint64_t frames, Pacing pacing = Pacing::Lockstep) : frames_(frames), pacing_(pacing) {
    info_ = {.description = "painted frames",
             .width = kTestWidth,
             .height = kTestHeight,
             .rate_hz = 30.0,
             .total_frames = frames,
             .slots_held = 0};
  }

  const SourceInfo& info() const override { return info_; }

  Status start(FramePool& pool) override {
    pool_ = &pool;
    return {};
  }

  Capture next(std::stop_token stop) override {
    if (frames_ != 0 && next_ == frames_) {
      return {CaptureKind::EndOfStream, {}, {}};
    }
    while (pool_->free_slots() == 0 && pacing_ == Pacing::Lockstep) {
      if (stop.stop_requested()) {
        return {};
      }
      SystemClock::instance().sleep_until(SystemClock::instance().now_ns() + kNsPerMs / 10);
    }
    std::optional<FrameWriter> frame = pool_->acquire();
    const std::uint64_t index = next_++;
    if (!frame) {
      return {CaptureKind::NoFreeSlot, {}, {}};
    }
    (*frame)->sequence = index;
    (*frame)->stamp_utc_ns = kTestStampNs + static_cast<std::int64_t>(index) * kTestPeriodNs;
    paint(**frame, static_cast<int>(index % 100));
    return {CaptureKind::Frame, std::move(*frame).share(), {}};
  }

 private:
  std::uint64_t frames_;
  Pacing pacing_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;
  std::uint64_t next_ = 0;
};

}  // namespace posed
