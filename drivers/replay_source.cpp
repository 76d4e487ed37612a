#include "drivers/replay_source.h"

#include <algorithm>
#include <cassert>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "core/logging.h"
#include "drivers/image_file.h"
#include "drivers/replay_decoder.h"
#include "drivers/tum_sequence.h"

namespace posed {

namespace {

// How long a sleep may overlook a stop request.
constexpr TimeNs kStopSliceNs = 50 * kNsPerMs;

class ReplaySource final : public RgbdSource {
 public:
  ReplaySource(TumSequence sequence, const SourceConfig& config, const CameraIntrinsics& camera, const Clock& clock);

  const SourceInfo& info() const override { return info_; }
  Status start(FramePool& pool) override;
  Capture next(std::stop_token stop) override;

 private:
  bool wait_until(TimeNs due_ns, const std::stop_token& stop);
  Capture deliver(ReplayItem& item, TimeNs capture_ns);

  const TumSequence sequence_;
  const ReplayDecoderOptions options_;
  const Pacing pacing_;
  const Clock& clock_;
  SourceInfo info_;
  std::size_t reported_lines_ = 0;
  std::optional<TimeNs> start_ns_;
  std::unique_ptr<ReplayDecoder> decoder_;
};

SourceInfo describe(const TumSequence& sequence, const ReplayConfig& config, const CameraIntrinsics& camera) {
  SourceInfo info;
  info.description = fmt::format("replay of {}, {} frames{}", sequence.folder.string(), sequence.pairs.size(),
                                 config.loop ? ", over and over" : "");
  if (sequence.unpaired > 0) {
    info.description += fmt::format(" ({} colour images without depth are left out)", sequence.unpaired);
  }
  info.width = camera.width;
  info.height = camera.height;
  info.rate_hz = 1.0 / to_seconds(sequence.period_ns);
  info.total_frames = config.loop ? 0 : sequence.pairs.size();
  info.slots_held = static_cast<std::size_t>(config.decode_ahead);
  return info;
}

ReplaySource::ReplaySource(TumSequence sequence, const SourceConfig& config, const CameraIntrinsics& camera, const Clock& clock)
    : sequence_(std::move(sequence)),
      options_{.depth_units_per_metre = camera.depth_units_per_metre,
               .decode_ahead = static_cast<std::size_t>(config.replay.decode_ahead),
               .loop = config.replay.loop,
               .wait_for_slots = config.pacing == Pacing::Lockstep},
      pacing_(config.pacing),
      clock_(clock),
      info_(describe(sequence_, config.replay, camera)) {}

Status ReplaySource::start(FramePool& pool) try {
  if (decoder_ != nullptr) {
    return make_error(ErrorCode::InvalidArgument, "the replay source was started before");
  }
  if (pool.width() != info_.width || pool.height() != info_.height) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the frame pool holds {}x{}, the recording {}x{}", pool.width(),
                                                              pool.height(), info_.width, info_.height));
  }
  decoder_ = std::make_unique<ReplayDecoder>(sequence_, options_, pool, clock_);
  return {};
} catch (const std::exception& exception) {
  return make_error(ErrorCode::Unavailable, fmt::format("cannot start the decoding thread: {}", exception.what()));
}

Capture ReplaySource::next(std::stop_token stop) {
  assert(decoder_ != nullptr && "start comes first");
  if (stop.stop_requested()) {
    return {};
  }
  heartbeat_.beat(clock_.now_ns());
  if (reported_lines_ < sequence_.skipped_lines.size()) {
    return {CaptureKind::SkippedFrame, {}, sequence_.skipped_lines[reported_lines_++]};
  }
  ReplayItem* item = decoder_->front(stop);
  if (item == nullptr) {
    return {};
  }
  if (item->kind == CaptureKind::EndOfStream || item->kind == CaptureKind::Failed) {
    return {item->kind, {}, item->error};
  }
  if (pacing_ == Pacing::Lockstep) {
    return deliver(*item, clock_.now_ns());
  }
  if (!start_ns_) {
    start_ns_ = clock_.now_ns();
    decoder_->begin(*start_ns_);
  }
  const TimeNs due_ns = *start_ns_ + item->elapsed_ns;
  return wait_until(due_ns, stop) ? deliver(*item, due_ns) : Capture{};
}

bool ReplaySource::wait_until(TimeNs due_ns, const std::stop_token& stop) {
  for (TimeNs now_ns = clock_.now_ns(); now_ns < due_ns; now_ns = clock_.now_ns()) {
    if (stop.stop_requested()) {
      return false;
    }
    heartbeat_.beat(now_ns);
    clock_.sleep_until(std::min(due_ns, now_ns + kStopSliceNs));
  }
  return true;
}

Capture ReplaySource::deliver(ReplayItem& item, TimeNs capture_ns) {
  Capture capture{item.kind, {}, std::move(item.error)};
  if (item.frame) {
    (*item.frame)->capture_ns = capture_ns;
    capture.frame = std::move(*item.frame).share();
    item.frame.reset();
  }
  decoder_->release();
  return capture;
}

/// Size of the first colour image that can be read, against the calibration's.
Status check_image_size(const TumSequence& sequence, const CameraIntrinsics& camera) {
  ImageDecoder decoder;
  Error first_error;
  for (const TumAssociation& pair : sequence.pairs) {
    const Result<ImageHeader> header = decoder.read_header(sequence.folder / pair.color.image);
    if (!header) {
      first_error = first_error.message.empty() ? header.error() : first_error;
      continue;
    }
    if (header->width == camera.width && header->height == camera.height) {
      return {};
    }
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("{}:{}: {} is {}x{}, the camera's calibration {}x{}; choose the calibration that belongs to the recording",
                    sequence.color_list.string(), pair.color.line, pair.color.image, header->width, header->height, camera.width,
                    camera.height));
  }
  first_error.message = fmt::format("{}: none of the {} colour images can be read; the first: {}", sequence.color_list.string(),
                                    sequence.pairs.size(), first_error.message);
  return tl::unexpected(std::move(first_error));
}

Result<std::unique_ptr<RgbdSource>> open_replay(const SourceConfig& config, const CameraIntrinsics& camera, const Clock& clock) {
  if (config.replay.decode_ahead < 1) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("decode_ahead is {}; at least 1 is needed", config.replay.decode_ahead));
  }
  Result<TumSequence> sequence = load_tum_sequence(config.replay);
  if (!sequence) {
    return tl::unexpected(std::move(sequence.error()));
  }
  if (Status size = check_image_size(*sequence, camera); !size) {
    return tl::unexpected(std::move(size.error()));
  }
  for (const std::string& warning : sequence->warnings) {
    log_warning("{}", warning);
  }
  return std::make_unique<ReplaySource>(*std::move(sequence), config, camera, clock);
}

}  // namespace

Result<std::unique_ptr<RgbdSource>> make_replay_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                       const Clock& clock) try {
  return open_replay(config, camera, clock);
} catch (const std::exception& exception) {
  return make_error(ErrorCode::Io, fmt::format("cannot open the recording '{}': {}", config.replay.sequence, exception.what()));
}

}  // namespace posed
