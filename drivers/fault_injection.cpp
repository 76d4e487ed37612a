#include "drivers/fault_injection.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "drivers/frame_guard.h"

namespace posed {

namespace {

struct KindName {
  std::string_view name;
  FaultKind kind;
  bool has_amount;
};

constexpr std::array<KindName, 10> kKinds = {{{"drop", FaultKind::Drop, false},
                                              {"thin", FaultKind::Thin, true},
                                              {"duplicate", FaultKind::Duplicate, false},
                                              {"freeze", FaultKind::Freeze, false},
                                              {"black", FaultKind::Black, false},
                                              {"white", FaultKind::White, false},
                                              {"zero_depth", FaultKind::ZeroDepth, false},
                                              {"nan_depth", FaultKind::NanDepth, false},
                                              {"half", FaultKind::Half, false},
                                              {"stamp", FaultKind::Stamp, true}}};

template <typename T>
void copy_pixels(const ImageView<T>& from, const ImageView<T>& to) {
  const std::size_t row_bytes = static_cast<std::size_t>(from.width) * static_cast<std::size_t>(from.channels) * sizeof(T);
  for (int y = 0; y < from.height; ++y) {
    std::memcpy(to.row(y), from.row(y), row_bytes);
  }
}

template <typename T>
void fill(const ImageView<T>& image, T value, int first_row = 0) {
  for (int y = first_row; y < image.height; ++y) {
    std::fill_n(image.row(y), static_cast<std::ptrdiff_t>(image.width) * image.channels, value);
  }
}

void copy_images(const RgbdFrame& from, RgbdFrame& to) {
  copy_pixels(from.bgr, to.bgr);
  copy_pixels(from.gray, to.gray);
  copy_pixels(from.depth_m, to.depth_m);
}

class FaultySource final : public RgbdSource {
 public:
  FaultySource(std::unique_ptr<RgbdSource> source, std::vector<Fault> faults, const Clock& clock)
      : source_(std::move(source)), faults_(std::move(faults)), clock_(clock), info_(source_->info()) {
    info_.description += fmt::format(", {} faults", faults_.size());
    info_.slots_held += 4;  // the frame as it came, the one with faults, the frozen one, the guard's
  }

  const SourceInfo& info() const override { return info_; }

  Status start(FramePool& pool) override {
    pool_ = &pool;
    return source_->start(pool);
  }

  Capture next(std::stop_token stop) override {
    while (!stop.stop_requested()) {
      heartbeat_.beat(clock_.now_ns());
      if (again_) {
        return guarded(std::exchange(again_, FrameRef()));
      }
      Capture capture = source_->next(stop);
      if (capture.kind != CaptureKind::Frame) {
        return capture;
      }
      if (std::optional<FrameRef> faulty = with_faults(capture.frame)) {
        return guarded(std::move(*faulty));
      }
    }
    return {};
  }

  SourceHealth health() const override { return source_->health(); }

 private:
  bool hits(const Fault& fault, std::uint64_t sequence) const { return sequence >= fault.first && sequence <= fault.last; }

  /// The frame with all faults that hit it; nothing where it is lost.
  std::optional<FrameRef> with_faults(const FrameRef& good) {
    const std::uint64_t sequence = good->sequence;
    FrameRef frame = good;
    bool frozen = false;
    for (const Fault& fault : faults_) {
      if (!hits(fault, sequence)) {
        continue;
      }
      if (fault.kind == FaultKind::Drop ||
          (fault.kind == FaultKind::Thin && (sequence - fault.first) % static_cast<std::uint64_t>(fault.amount) != 0)) {
        return std::nullopt;
      }
      if (fault.kind == FaultKind::Duplicate) {
        again_ = good;
        continue;
      }
      frozen = frozen || fault.kind == FaultKind::Freeze;
      std::optional<FrameWriter> copy = pool_->acquire();
      if (!copy) {
        return std::nullopt;  // lost, as it would be on its way into a full pool
      }
      spoil(fault, *frame, **copy);
      frame = std::move(*copy).share();
    }
    if (!frozen) {
      before_freeze_ = frame;
    }
    return frame;
  }

  void spoil(const Fault& fault, const RgbdFrame& from, RgbdFrame& to) const {
    to.sequence = from.sequence;
    to.capture_ns = from.capture_ns;
    to.stamp_utc_ns = from.stamp_utc_ns;
    to.depth_offset_ns = from.depth_offset_ns;
    to.T_world_camera_truth = from.T_world_camera_truth;
    copy_images(fault.kind == FaultKind::Freeze && before_freeze_ ? *before_freeze_ : from, to);
    const int half = to.gray.height / 2;
    switch (fault.kind) {
      case FaultKind::Black:
      case FaultKind::White: {
        const std::uint8_t value = fault.kind == FaultKind::Black ? 0 : 255;
        fill(to.bgr, value);
        fill(to.gray, value);
        break;
      }
      case FaultKind::ZeroDepth: fill(to.depth_m, 0.0F); break;
      case FaultKind::NanDepth: fill(to.depth_m, std::numeric_limits<float>::quiet_NaN()); break;
      case FaultKind::Half:
        fill(to.bgr, std::uint8_t{0}, half);
        fill(to.gray, std::uint8_t{0}, half);
        fill(to.depth_m, 0.0F, half);
        break;
      case FaultKind::Stamp:
        to.capture_ns += from_seconds(fault.amount);
        to.stamp_utc_ns += from_seconds(fault.amount);
        break;
      case FaultKind::Drop:
      case FaultKind::Thin:
      case FaultKind::Duplicate:
      case FaultKind::Freeze: break;
    }
  }

  Capture guarded(FrameRef frame) {
    if (const std::optional<std::string> reason = guard_.judge(*frame, clock_.now_ns())) {
      return {CaptureKind::SkippedFrame, {}, {ErrorCode::BadData, *reason}};
    }
    guard_.remember(frame);
    return {CaptureKind::Frame, std::move(frame), {}};
  }

  std::unique_ptr<RgbdSource> source_;
  std::vector<Fault> faults_;
  const Clock& clock_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;
  FrameRef again_;          // to be delivered a second time
  FrameRef before_freeze_;  // the last frame that was not frozen
  FrameGuard guard_;
};

}  // namespace

Result<Fault> parse_fault(std::string_view text) {
  const auto refuse = [&](std::string_view reason) {
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("fault \"{}\": {}; a fault is written KIND FIRST-LAST [AMOUNT], as \"black 120-150\"", text, reason));
  };
  std::istringstream words{std::string(text)};
  std::string kind, frames, amount, more;
  words >> kind >> frames >> amount >> more;
  const auto known = std::find_if(kKinds.begin(), kKinds.end(), [&](const KindName& k) { return k.name == kind; });
  if (known == kKinds.end()) {
    return refuse("there is no such kind");
  }
  Fault fault{known->kind, 0, 0, 0};
  const char* const end = frames.data() + frames.size();
  const auto first = std::from_chars(frames.data(), end, fault.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') {
    return refuse("the frames are not FIRST-LAST");
  }
  const auto last = std::from_chars(first.ptr + 1, end, fault.last);
  if (last.ec != std::errc() || last.ptr != end || fault.last < fault.first) {
    return refuse("the frames are not FIRST-LAST");
  }
  if (known->has_amount == amount.empty() || !more.empty()) {
    return refuse(known->has_amount ? "this kind needs one amount" : "this kind has no amount");
  }
  if (known->has_amount) {
    const auto value = std::from_chars(amount.data(), amount.data() + amount.size(), fault.amount);
    if (value.ec != std::errc() || value.ptr != amount.data() + amount.size() || !(std::abs(fault.amount) <= 1e6)) {
      return refuse("the amount is no number up to a million");
    }
    if (fault.kind == FaultKind::Thin && (fault.amount < 2 || fault.amount != std::floor(fault.amount))) {
      return refuse("of how many frames one is left must be a whole number from 2 on");
    }
  }
  return fault;
}

std::unique_ptr<RgbdSource> with_faults(std::unique_ptr<RgbdSource> source, std::vector<Fault> faults, const Clock& clock) {
  return std::make_unique<FaultySource>(std::move(source), std::move(faults), clock);
}

}  // namespace posed
