#include "drivers/synthetic_source.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "drivers/synthetic_camera.h"

namespace posed {

namespace {

constexpr TimeNs kLongestSleep_ns = 20 * kNsPerMs;  ///< between looks at the stop token
constexpr TimeNs kSlotPoll_ns = kNsPerMs;

class SyntheticSource final : public RgbdSource {
 public:
  SyntheticSource(std::unique_ptr<SyntheticCamera> camera, const SourceConfig& config, const Clock& clock)
      : camera_(std::move(camera)), pacing_(config.pacing), clock_(clock) {
    const CameraIntrinsics& k = camera_->intrinsics();
    const char* doing = config.synthetic.mode == SyntheticMode::Sitting ? "sitting" : "walking";
    const std::string_view world = world_name(config.synthetic.world);
    info_ = {.description =
                 fmt::format("synthetic {}, {} people {}, seed {}", world, config.synthetic.people, doing, config.synthetic.seed),
             .width = k.width,
             .height = k.height,
             .rate_hz = config.synthetic.rate_hz,
             .total_frames = camera_->total_frames(),
             .slots_held = pacing_ == Pacing::Realtime ? std::size_t{1} : std::size_t{0}};
  }

  const SourceInfo& info() const override { return info_; }

  Status start(FramePool& pool) override {
    if (pool.width() != info_.width || pool.height() != info_.height) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("the frame pool holds {}x{} pixels, the synthetic source delivers {}x{}", pool.width(),
                                    pool.height(), info_.width, info_.height));
    }
    pool_ = &pool;
    next_index_ = 0;
    // Frame 0 has a period's time to be rendered in.
    start_ns_ = clock_.now_ns() + camera_->due_ns(1);
    return {};
  }

  Capture next(std::stop_token stop) override {
    if (pool_ == nullptr) {
      return {
          .kind = CaptureKind::Failed, .frame = {}, .error = {ErrorCode::InvalidArgument, "the synthetic source was not started"}};
    }
    heartbeat_.beat(clock_.now_ns());
    return pacing_ == Pacing::Realtime ? next_realtime(stop) : next_lockstep(stop);
  }

 private:
  bool ended() const { return info_.total_frames != 0 && next_index_ >= info_.total_frames; }
  TimeNs due_ns(std::uint64_t index) const { return start_ns_ + camera_->due_ns(index); }

  /// False where the stop came first.
  bool sleep_until(TimeNs deadline_ns, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const TimeNs now_ns = clock_.now_ns();
      if (now_ns >= deadline_ns) {
        return true;
      }
      heartbeat_.beat(now_ns);
      clock_.sleep_until(std::min(deadline_ns, now_ns + kLongestSleep_ns));
    }
    return false;
  }

  /// Leaves out the frames whose whole period is over.
  void skip_what_has_passed() {
    const TimeNs late_ns = clock_.now_ns() - start_ns_;
    if (late_ns <= camera_->due_ns(next_index_ + 1)) {
      return;
    }
    next_index_ = static_cast<std::uint64_t>(to_seconds(late_ns) * info_.rate_hz);
    while (camera_->due_ns(next_index_) < late_ns) {
      ++next_index_;
    }
  }

  Capture next_realtime(const std::stop_token& stop) {
    skip_what_has_passed();
    if (stop.stop_requested()) {
      return {};
    }
    if (ended()) {
      return {.kind = CaptureKind::EndOfStream, .frame = {}, .error = {}};
    }
    const std::uint64_t index = next_index_++;
    std::optional<FrameWriter> writer = pool_->acquire();
    if (!writer) {
      return sleep_until(due_ns(index), stop) ? Capture{.kind = CaptureKind::NoFreeSlot, .frame = {}, .error = {}} : Capture{};
    }
    if (Status status = camera_->render(index, **writer); !status) {
      return {.kind = CaptureKind::Failed, .frame = {}, .error = status.error()};
    }
    if (!sleep_until(due_ns(index), stop)) {
      return {};
    }
    (*writer)->capture_ns = due_ns(index);
    (*writer)->stamp_utc_ns = clock_.utc_ns(due_ns(index));
    return {.kind = CaptureKind::Frame, .frame = std::move(*writer).share(), .error = {}};
  }

  Capture next_lockstep(const std::stop_token& stop) {
    if (ended()) {
      return {.kind = CaptureKind::EndOfStream, .frame = {}, .error = {}};
    }
    std::optional<FrameWriter> writer;
    while (!stop.stop_requested()) {
      writer.reset();
      if (std::optional<FrameWriter> free = pool_->acquire()) {
        writer.emplace(std::move(*free));
        break;
      }
      heartbeat_.beat(clock_.now_ns());
      clock_.sleep_until(clock_.now_ns() + kSlotPoll_ns);
    }
    if (!writer) {
      return {};
    }
    if (Status status = camera_->render(next_index_, **writer); !status) {
      return {.kind = CaptureKind::Failed, .frame = {}, .error = status.error()};
    }
    ++next_index_;
    (*writer)->capture_ns = clock_.now_ns();
    return {.kind = CaptureKind::Frame, .frame = std::move(*writer).share(), .error = {}};
  }

  std::unique_ptr<SyntheticCamera> camera_;
  Pacing pacing_;
  const Clock& clock_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;
  std::uint64_t next_index_ = 0;
  TimeNs start_ns_ = 0;
};

}  // namespace

Result<std::unique_ptr<RgbdSource>> make_synthetic_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                          const Clock& clock) {
  auto synthetic = SyntheticCamera::create(config.synthetic, camera);
  if (!synthetic) {
    return tl::unexpected(synthetic.error());
  }
  return std::make_unique<SyntheticSource>(std::move(*synthetic), config, clock);
}

}  // namespace posed
