#include "drivers/libcamera/libcamera_camera.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>

namespace posed {

namespace {

/// What may wait for its partner: the camera must always have a buffer to fill while another is read.
std::size_t spare_buffers(std::size_t buffers) {
  constexpr std::size_t kInUse = 2;
  return buffers > kInUse ? buffers - kInUse : 1;
}

}  // namespace

LibcameraCamera::LibcameraCamera(std::unique_ptr<ColorCamera> color, V4l2System& system, const SourceConfig& source,
                                 const CameraIntrinsics& intrinsics, const Clock& clock)
    : clock_(clock),
      max_difference_ns_(from_seconds(source.live.max_stamp_difference_s)),
      system_(system),
      color_(std::move(color)),
      description_(fmt::format("{}, depth {}", color_->description(), source.depth.node.device)),
      depth_(system, clock, source.depth, intrinsics, source.live.rate_hz),
      pairer_({}),
      completed_(kMostBuffers),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Status LibcameraCamera::open() {
  if (wake_.get() < 0) {
    return make_error(ErrorCode::Io, description_ + ": no descriptor is left to wait on");
  }
  if (Status opened = color_->open(*this); !opened) {
    return opened;
  }
  if (color_->buffers() > kMostBuffers) {
    const std::size_t buffers = color_->buffers();
    close();
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: it has {} buffers, at most {} can be used", description_, buffers, kMostBuffers));
  }
  if (Status opened = depth_.open(); !opened) {
    close();
    return opened;
  }
  bytes_used_.assign(color_->buffers(), 0);
  const V4l2Stream& depth = depth_.stream();
  pairer_ = FramePairer({.max_difference_ns = max_difference_ns_,
                         .period_ns = {color_->period_ns(), depth.period_ns()},
                         .capacity = {spare_buffers(color_->buffers()), spare_buffers(depth.buffers())}});
  // Pairs come no faster than the slower camera delivers, so its gaps are those of the frames.
  counted_ = depth.period_ns() > color_->period_ns() ? PairSide::Depth : PairSide::Color;
  return {};
}

void LibcameraCamera::close() noexcept {
  color_->close();  // from here on libcamera's thread is silent
  depth_.close();
  while (completed_.front() != nullptr) {
    completed_.release();
  }
  eventfd_t count = 0;
  eventfd_read(wake_.get(), &count);
  disconnected_.store(false, std::memory_order_relaxed);
  failed_.reset();
  stamps_.restart();
}

CameraRead LibcameraCamera::read(RgbdFrame* frame, TimeNs timeout_ns) {
  const TimeNs deadline_ns = clock_.now_ns() + timeout_ns;
  while (true) {
    while (completed_.front() != nullptr) {
      if (std::optional<CameraRead> got = take_color(frame)) {
        return std::move(*got);
      }
    }
    if (disconnected_.load(std::memory_order_acquire)) {
      return {CameraReadKind::Gone, {ErrorCode::NotFound, description_ + ": the colour camera was disconnected"}};
    }
    if (failed_) {
      return {CameraReadKind::Gone, *std::exchange(failed_, std::nullopt)};
    }
    std::array<pollfd, 2> waited{{{wake_.get(), POLLIN, 0}, {depth_.stream().descriptor(), POLLIN, 0}}};
    if (system_.poll(waited, deadline_ns - clock_.now_ns()) < 0) {
      return {CameraReadKind::Gone, {ErrorCode::Io, description_ + ": poll failed"}};
    }
    if (waited[0].revents != 0) {
      eventfd_t count = 0;
      eventfd_read(wake_.get(), &count);
    }
    if (waited[1].revents != 0) {
      depth_.stream().note_poll(waited[1].revents);
      if (std::optional<CameraRead> got = take_depth(frame)) {
        return std::move(*got);
      }
    }
    if (waited[0].revents == 0 && clock_.now_ns() >= deadline_ns) {
      return {};
    }
  }
}

void LibcameraCamera::on_completed(const CompletedImage& image) noexcept {
  // There is a place for each buffer, and none completes twice before it is given back.
  if (CompletedImage* const place = completed_.claim()) {
    *place = image;
    completed_.commit();
  }
  wake();
}

void LibcameraCamera::on_disconnected() noexcept {
  disconnected_.store(true, std::memory_order_release);
  wake();
}

void LibcameraCamera::wake() noexcept {
  eventfd_write(wake_.get(), 1);
}

/// The oldest completed image; nothing where there is no pair yet.
std::optional<CameraRead> LibcameraCamera::take_color(RgbdFrame* frame) {
  const CompletedImage image = *completed_.front();
  completed_.release();
  if (image.kind == CompletedImage::Kind::Cancelled) {
    return CameraRead{CameraReadKind::Gone, {ErrorCode::Unavailable, description_ + ": the colour camera has stopped"}};
  }
  if (image.kind == CompletedImage::Kind::Damaged) {
    give_back(PairSide::Color, image.buffer);
    return CameraRead{
        CameraReadKind::BadFrame,
        {ErrorCode::BadData, fmt::format("{}: the camera marks colour image {} as damaged", description_, image.sequence)}};
  }
  bytes_used_[image.buffer] = image.bytes_used;
  const TimeNs capture_ns = stamps_.time_of(image.stamp_ns, image.arrival_ns);
  count_clocks();
  return pair(PairSide::Color, {capture_ns, image.sequence, image.buffer}, frame);
}

/// Nothing where there is no pair yet.
std::optional<CameraRead> LibcameraCamera::take_depth(RgbdFrame* frame) {
  V4l2Take took = depth_.stream().take();
  count_clocks();
  if (took.kind == CameraReadKind::Nothing) {
    return std::nullopt;
  }
  if (took.kind != CameraReadKind::Frame) {
    return CameraRead{took.kind, std::move(took.error)};
  }
  return pair(PairSide::Depth, {took.image.capture_ns, took.image.sequence, took.image.buffer}, frame);
}

std::optional<CameraRead> LibcameraCamera::pair(PairSide side, const UnpairedImage& image, RgbdFrame* frame) {
  const FramePairer::Outcome outcome = pairer_.add(side, image);
  for (const FramePairer::Discarded& discarded : outcome.discarded()) {
    give_back(discarded.side, discarded.image.buffer);
    metrics_.unpaired.add();
  }
  return outcome.paired ? std::optional(deliver(outcome, frame)) : std::nullopt;
}

CameraRead LibcameraCamera::deliver(const FramePairer::Outcome& pair, RgbdFrame* frame) {
  Status written;
  if (frame != nullptr) {
    const std::uint32_t buffer = pair.color.buffer;
    written = write_color(color_->format(), color_->planes(buffer), bytes_used_[buffer], mjpeg_, *frame);
    if (written) {
      depth_.write_depth(depth_.stream().image_in(pair.depth.buffer), frame->depth_m);
      pair.stamp(*frame, counted_);
    }
  }
  give_back(PairSide::Color, pair.color.buffer);
  give_back(PairSide::Depth, pair.depth.buffer);
  if (!written) {
    return {
        CameraReadKind::BadFrame,
        {written.error().code, fmt::format("{}: colour image {}: {}", description_, pair.color.sequence, written.error().message)}};
  }
  return {CameraReadKind::Frame, {}};
}

void LibcameraCamera::give_back(PairSide side, std::uint32_t buffer) {
  if (side == PairSide::Depth) {
    depth_.stream().give_back(buffer);
  } else if (Status given = color_->give_back(buffer); !given) {
    failed_ = std::move(given).error();
  }
}

void LibcameraCamera::count_clocks() {
  const V4l2Stamps& depth = depth_.stream().stamps();
  metrics_.clock_error_ns.set(std::max(stamps_.error_ns(), depth.error_ns()));
  const std::uint64_t resets = stamps_.resets() + depth.resets();
  metrics_.clock_resets.add(resets - clock_resets_);
  clock_resets_ = resets;
}

}  // namespace posed
