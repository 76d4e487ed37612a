#include "drivers/v4l2/v4l2_camera.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace posed {

namespace {

/// What may wait for its partner: the driver must always have a buffer to fill while another is read.
std::size_t spare_buffers(const V4l2Stream& stream) {
  constexpr std::size_t kInUse = 2;
  return stream.buffers() > kInUse ? stream.buffers() - kInUse : 1;
}

}  // namespace

V4l2Camera::V4l2Camera(V4l2System& system, const SourceConfig& source, const CameraIntrinsics& color, const Clock& clock)
    : clock_(clock),
      description_(fmt::format("V4L2 camera {}, depth {}", source.v4l2.device, source.depth.node.device)),
      max_difference_ns_(from_seconds(source.live.max_stamp_difference_s)),
      system_(system),
      color_(system, clock, source.v4l2, color, source.live.rate_hz),
      depth_(system, clock, source.depth, color, source.live.rate_hz),
      pairer_({}) {}

Status V4l2Camera::open() {
  if (Status opened = color_.open(); !opened) {
    return opened;
  }
  if (Status opened = depth_.open(); !opened) {
    close();
    return opened;
  }
  const V4l2Stream& color = color_.stream();
  const V4l2Stream& depth = depth_.stream();
  pairer_ = FramePairer({.max_difference_ns = max_difference_ns_,
                         .period_ns = {color.period_ns(), depth.period_ns()},
                         .capacity = {spare_buffers(color), spare_buffers(depth)}});
  // Pairs come no faster than the slower node delivers, so its gaps are those of the frames.
  counted_ = depth.period_ns() > color.period_ns() ? PairSide::Depth : PairSide::Color;
  return {};
}

void V4l2Camera::close() noexcept {
  color_.close();
  depth_.close();
  pairer_.clear();
}

CameraRead V4l2Camera::read(RgbdFrame* frame, TimeNs timeout_ns) {
  const TimeNs deadline_ns = clock_.now_ns() + timeout_ns;
  while (true) {
    std::array<pollfd, 2> nodes{{{color_.stream().descriptor(), POLLIN, 0}, {depth_.stream().descriptor(), POLLIN, 0}}};
    const int ready = system_.poll(nodes, deadline_ns - clock_.now_ns());
    if (ready < 0) {
      return {CameraReadKind::Gone, {ErrorCode::Io, fmt::format("{}: poll failed", description_)}};
    }
    for (const PairSide side : {PairSide::Color, PairSide::Depth}) {
      const short revents = nodes[static_cast<std::size_t>(side)].revents;
      if (revents != 0) {
        stream(side).note_poll(revents);
        if (std::optional<CameraRead> got = take(side, frame)) {
          return std::move(*got);
        }
      }
    }
    if (clock_.now_ns() >= deadline_ns) {
      return {};
    }
  }
}

/// Nothing where there is no pair yet.
std::optional<CameraRead> V4l2Camera::take(PairSide side, RgbdFrame* frame) {
  V4l2Take took = stream(side).take();
  count_clocks();
  if (took.kind == CameraReadKind::Nothing) {
    return std::nullopt;
  }
  if (took.kind != CameraReadKind::Frame) {
    return CameraRead{took.kind, std::move(took.error)};
  }
  const FramePairer::Outcome outcome = pairer_.add(side, {took.image.capture_ns, took.image.sequence, took.image.buffer});
  for (const FramePairer::Discarded& discarded : outcome.discarded()) {
    stream(discarded.side).give_back(discarded.image.buffer);
    metrics_.unpaired.add();
  }
  return outcome.paired ? std::optional(deliver(outcome, frame)) : std::nullopt;
}

CameraRead V4l2Camera::deliver(const FramePairer::Outcome& pair, RgbdFrame* frame) {
  Status written;
  if (frame != nullptr) {
    written = color_.write_color(color_.stream().image_in(pair.color.buffer), *frame);
    if (written) {
      depth_.write_depth(depth_.stream().image_in(pair.depth.buffer), frame->depth_m);
      pair.stamp(*frame, counted_);
    }
  }
  color_.stream().give_back(pair.color.buffer);
  depth_.stream().give_back(pair.depth.buffer);
  if (!written) {
    return {CameraReadKind::BadFrame, std::move(written).error()};
  }
  return {CameraReadKind::Frame, {}};
}

void V4l2Camera::count_clocks() {
  const V4l2Stamps& color = color_.stream().stamps();
  const V4l2Stamps& depth = depth_.stream().stamps();
  metrics_.clock_error_ns.set(std::max(color.error_ns(), depth.error_ns()));
  const std::uint64_t resets = color.resets() + depth.resets();
  metrics_.clock_resets.add(resets - clock_resets_);
  clock_resets_ = resets;
}

}  // namespace posed
