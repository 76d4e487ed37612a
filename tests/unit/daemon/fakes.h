#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/frame_pool.h"
#include "daemon/slam_ports.h"
#include "drivers/rgbd_source.h"
#include "tests/unit/daemon/fake_mapper.h"

/// Stand-ins for clock, source and tracker (and for the mapper, fake_mapper.h), so that the pipeline's own behaviour can be driven
/// step by step.
namespace posed {

/// Time that moves only when a test says so; UTC runs `kUtcOffsetNs` ahead of it.
class ManualClock final : public Clock {
 public:
  static constexpr std::int64_t kUtcOffsetNs = 1'700'000'000 * kNsPerSecond;

  TimeNs now_ns() const noexcept override { return now_ns_; }
  void sleep_until(TimeNs deadline_ns) const override { now_ns_ = deadline_ns; }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return monotonic_ns + kUtcOffsetNs; }
  void advance(TimeNs by_ns) { now_ns_ += by_ns; }

 private:
  mutable TimeNs now_ns_ = 1'000 * kNsPerSecond;
};

/// Delivers what `script` says for call 0, 1, 2, ...; CaptureKind::Stopped there means: block until the stop is requested.
class FakeSource final : public RgbdSource {
 public:
  using Script = std::function<CaptureKind(std::uint64_t call)>;

  explicit FakeSource(Script script, Status start_status = {})
      : script_(std::move(script)), start_status_(std::move(start_status)) {
    info_.description = "fake";
    info_.width = 16;
    info_.height = 8;
    info_.slots_held = 1;
  }

  /// `frames` frames, then the end.
  static Script recording(std::uint64_t frames) {
    return [frames](std::uint64_t call) { return call < frames ? CaptureKind::Frame : CaptureKind::EndOfStream; };
  }

  const SourceInfo& info() const override { return info_; }

  Status start(FramePool& pool) override {
    pool_ = &pool;
    std::optional<FrameWriter> slot = pool.acquire();
    if (start_status_ && slot) {
      decoded_ahead_ =
          std::move(*slot).share();  // as a source does that decodes ahead: the pool must be there when this is given back
    }
    return start_status_;
  }

  Capture next(std::stop_token stop) override {
    Capture capture;
    capture.kind = script_(call_++);
    if (capture.kind == CaptureKind::Stopped) {
      while (!stop.stop_requested()) {
        std::this_thread::yield();
      }
    } else if (capture.kind == CaptureKind::Frame) {
      std::optional<FrameWriter> slot = pool_->acquire();
      if (!slot) {
        capture.kind = CaptureKind::NoFreeSlot;
        return capture;
      }
      (*slot)->sequence = sequence_++;
      (*slot)->capture_ns = SystemClock::instance().now_ns();
      (*slot)->stamp_utc_ns = static_cast<std::int64_t>((*slot)->sequence) * kNsPerSecond;
      capture.frame = std::move(*slot).share();
    } else if (capture.kind == CaptureKind::SkippedFrame || capture.kind == CaptureKind::Failed) {
      capture.error = Error{ErrorCode::BadData, "scripted"};
    }
    return capture;
  }

 private:
  Script script_;
  Status start_status_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;
  FrameRef decoded_ahead_;
  std::uint64_t call_ = 0;
  std::uint64_t sequence_ = 0;
};

/// Tracks every frame, makes every `keyframe_interval`-th one a keyframe, and reports the version of the map it was shown.
class FakeTracker final : public FrameTracker {
 public:
  std::uint64_t keyframe_interval = 5;
  std::function<TrackingState(std::uint64_t sequence)> state = [](std::uint64_t) { return TrackingState::Tracking; };
  std::function<void(const RgbdFrame&)> on_frame = [](const RgbdFrame&) {};

  std::function<void(const RgbdFrame&, const Detections*)> on_detections = [](const RgbdFrame&, const Detections*) {};

  PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, const Detections* newest, KeyframeRecord* candidate) override {
    on_frame(frame);
    on_detections(frame, newest);
    PoseEstimate estimate;
    estimate.sequence = frame.sequence;
    estimate.capture_ns = frame.capture_ns;
    estimate.stamp_utc_ns = frame.stamp_utc_ns;
    estimate.state = state(frame.sequence);
    estimate.map_version = map.version;
    if (candidate != nullptr && frame.sequence % keyframe_interval == 0) {
      candidate->id = ++keyframes_;
      candidate->sequence = frame.sequence;
      candidate->landmarks.assign(100, kNoLandmark);
      estimate.keyframe = true;
    }
    return estimate;
  }

 private:
  KeyframeId keyframes_ = 0;
};

}  // namespace posed
