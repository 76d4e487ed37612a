#include "drivers/camera_source.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "drivers/frame_guard.h"

namespace posed {

namespace {

constexpr TimeNs kLook_ns = 20 * kNsPerMs;        // between looks at the stop token
constexpr TimeNs kFirstRetry_ns = 50 * kNsPerMs;  // doubled with each attempt
constexpr std::uint64_t kLargestGap = 1000;       // frames; more is a count that began anew

class CameraSource final : public RgbdSource {
 public:
  CameraSource(std::unique_ptr<Camera> camera, const CameraSourceOptions& options, const Clock& clock)
      : camera_(std::move(camera)), options_(options), clock_(clock) {
    info_ = {.description = camera_->description(),
             .width = options.width,
             .height = options.height,
             .rate_hz = options.live.rate_hz,
             .total_frames = 0,
             .slots_held = 2};
  }

  ~CameraSource() override { camera_->close(); }

  const SourceInfo& info() const override { return info_; }

  Status start(FramePool& pool) override {
    if (pool.width() != info_.width || pool.height() != info_.height) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("the frame pool holds {}x{} pixels, the camera delivers {}x{}",
                                                                pool.width(), pool.height(), info_.width, info_.height));
    }
    pool_ = &pool;
    return {};
  }

  Capture next(std::stop_token stop) override {
    if (pool_ == nullptr) {
      return {CaptureKind::Failed, {}, {ErrorCode::InvalidArgument, "the camera's source was not started"}};
    }
    while (!stop.stop_requested()) {
      heartbeat_.beat(clock_.now_ns());
      std::optional<Capture> capture = open_ ? read() : reopen();
      if (capture) {
        return std::move(*capture);
      }
    }
    return {};
  }

  SourceHealth health() const override {
    const CameraMetrics& metrics = camera_->metrics();
    return {.connected = connected_.load(std::memory_order_relaxed),
            .reconnects = reconnects_.value(),
            .stalls = stalls_.value(),
            .unpaired = metrics.unpaired.value(),
            .clock_resets = metrics.clock_resets.value(),
            .clock_error_ns = metrics.clock_error_ns.value()};
  }

 private:
  /// Nothing where it is not yet time, the camera is open now, or the reason has been told before.
  std::optional<Capture> reopen() {
    const TimeNs now_ns = clock_.now_ns();
    if (now_ns < retry_ns_) {
      clock_.sleep_until(std::min(retry_ns_, now_ns + kLook_ns));
      return std::nullopt;
    }
    if (Status opened = camera_->open(); !opened) {
      retry_ns_ = clock_.now_ns() + wait_ns_;
      wait_ns_ = std::min(2 * wait_ns_, from_seconds(options_.live.retry_period_s));
      if (opened.error().message == told_) {
        return std::nullopt;
      }
      told_ = opened.error().message;
      return Capture{CaptureKind::Interrupted, {}, std::move(opened).error()};
    }
    open_ = true;
    last_frame_ns_ = clock_.now_ns();
    device_sequence_.reset();
    guard_.forget_image();
    return std::nullopt;
  }

  std::optional<Capture> read() {
    std::optional<FrameWriter> writer = pool_->acquire();
    if (!writer && options_.pacing == Pacing::Lockstep) {
      clock_.sleep_until(clock_.now_ns() + kNsPerMs);
      return std::nullopt;
    }
    CameraRead got = camera_->read(writer ? &**writer : nullptr, kLook_ns);
    switch (got.kind) {
      case CameraReadKind::Frame: return writer ? deliver(std::move(*writer)) : delivered_nowhere();
      case CameraReadKind::Nothing: return check_stall();
      case CameraReadKind::BadFrame: return Capture{CaptureKind::SkippedFrame, {}, std::move(got.error)};
      case CameraReadKind::Gone: return interrupt(std::move(got.error));
      case CameraReadKind::End: return Capture{CaptureKind::EndOfStream, {}, {}};
    }
    return std::nullopt;
  }

  Capture deliver(FrameWriter writer) {
    note_delivery();
    RgbdFrame& frame = *writer;
    const TimeNs now_ns = clock_.now_ns();
    if (std::optional<std::string> reason = guard_.judge(frame, now_ns)) {
      return {CaptureKind::SkippedFrame, {}, {ErrorCode::BadData, std::move(*reason)}};
    }
    frame.sequence = count(frame.sequence);
    const std::int64_t utc_ns = frame.stamp_utc_ns != 0 ? frame.stamp_utc_ns : clock_.utc_ns(frame.capture_ns);
    last_stamp_utc_ns_ = std::max(last_stamp_utc_ns_ + 1, utc_ns);
    frame.stamp_utc_ns = last_stamp_utc_ns_;
    FrameRef shared = std::move(writer).share();
    guard_.remember(shared);
    return {CaptureKind::Frame, std::move(shared), {}};
  }

  Capture delivered_nowhere() {
    note_delivery();
    return {CaptureKind::NoFreeSlot, {}, {}};
  }

  void note_delivery() {
    last_frame_ns_ = clock_.now_ns();
    wait_ns_ = kFirstRetry_ns;
    told_.clear();
    if (!connected_.load(std::memory_order_relaxed)) {
      connected_.store(true, std::memory_order_relaxed);
      if (delivered_before_) {
        reconnects_.add();
      }
    }
    delivered_before_ = true;
  }

  /// Our count for the device's: its gaps are ours.
  std::uint64_t count(std::uint64_t device_sequence) {
    if (device_sequence_ && device_sequence > *device_sequence_ + 1 && device_sequence - *device_sequence_ <= kLargestGap) {
      next_sequence_ += device_sequence - *device_sequence_ - 1;
    }
    device_sequence_ = device_sequence;
    return next_sequence_++;
  }

  std::optional<Capture> check_stall() {
    const TimeNs silent_ns = clock_.now_ns() - last_frame_ns_;
    if (options_.pacing == Pacing::Lockstep || silent_ns < from_seconds(options_.live.stall_timeout_s)) {
      return std::nullopt;
    }
    stalls_.add();
    return interrupt({ErrorCode::Unavailable,
                      fmt::format("{}: no frame for {:.1f} s; it is opened again", info_.description, to_seconds(silent_ns))});
  }

  /// The camera is closed, to be opened again.
  std::optional<Capture> interrupt(Error error) {
    camera_->close();
    open_ = false;
    connected_.store(false, std::memory_order_relaxed);
    // One that opens and delivers nothing waits longer each time, too.
    retry_ns_ = clock_.now_ns() + wait_ns_;
    wait_ns_ = std::min(2 * wait_ns_, from_seconds(options_.live.retry_period_s));
    if (error.message == told_) {
      return std::nullopt;
    }
    told_ = error.message;
    return Capture{CaptureKind::Interrupted, {}, std::move(error)};
  }

  std::unique_ptr<Camera> camera_;
  CameraSourceOptions options_;
  const Clock& clock_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;

  bool open_ = false;
  TimeNs retry_ns_ = std::numeric_limits<TimeNs>::min();
  TimeNs wait_ns_ = kFirstRetry_ns;
  std::string told_;  // the last reason why there is no frame
  TimeNs last_frame_ns_ = 0;
  FrameGuard guard_;
  std::int64_t last_stamp_utc_ns_ = std::numeric_limits<std::int64_t>::min();
  std::optional<std::uint64_t> device_sequence_;  // of the newest frame since the camera was opened
  std::uint64_t next_sequence_ = 0;
  bool delivered_before_ = false;

  std::atomic<bool> connected_{false};
  Counter reconnects_;
  Counter stalls_;
};

}  // namespace

std::unique_ptr<RgbdSource> make_camera_source(std::unique_ptr<Camera> camera, const CameraSourceOptions& options,
                                               const Clock& clock) {
  return std::make_unique<CameraSource>(std::move(camera), options, clock);
}

}  // namespace posed
