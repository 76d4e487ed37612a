#include "drivers/replay_decoder.h"

#include <exception>
#include <pthread.h>
#include <sched.h>
#include <utility>

#include <fmt/format.h>

namespace posed {

namespace {

// How long a wait may overlook a stop request.
constexpr TimeNs kStopSliceNs = 20 * kNsPerMs;
// Nothing tells when a slot comes back to the pool, so an empty pool is asked again at this interval.
constexpr TimeNs kSlotPollNs = kNsPerMs;

/// The constructing thread may be the capture thread with a real-time policy, which new threads inherit; decoding must not preempt.
void leave_realtime_policy() {
  const sched_param none{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
}

Error at_line(const std::filesystem::path& list, int line, Error error) {
  error.message = fmt::format("{}:{}: {}", list.string(), line, error.message);
  return error;
}

}  // namespace

ReplayDecoder::ReplayDecoder(const TumSequence& sequence, const ReplayDecoderOptions& options, FramePool& pool, const Clock& clock)
    : sequence_(sequence),
      options_(options),
      pool_(pool),
      clock_(clock),
      ring_(options.decode_ahead),
      thread_({.name = "decode", .policy = SchedulingPolicy::Normal, .priority = 0, .cpus = {}},
              [this](std::stop_token stop) { run(std::move(stop)); }) {}

ReplayDecoder::~ReplayDecoder() {
  thread_.request_stop();
  taken_.notify();
  thread_.join();
}

ReplayItem* ReplayDecoder::front(std::stop_token stop) {
  while (!stop.stop_requested()) {
    const std::uint32_t seen = decoded_.generation();
    if (ReplayItem* item = ring_.front()) {
      return item;
    }
    decoded_.wait(seen, kStopSliceNs);
  }
  return nullptr;
}

void ReplayDecoder::release() {
  ring_.release();
  taken_.notify();
}

void ReplayDecoder::run(std::stop_token stop) {
  leave_realtime_policy();
  try {
    bool any_good = true;
    for (std::uint64_t pass = 0; any_good && (pass == 0 || options_.loop) && !stop.stop_requested(); ++pass) {
      any_good = run_pass(pass, stop);
    }
    if (ReplayItem* item = wait_for_room(stop); item != nullptr && any_good) {
      finish(*item, CaptureKind::EndOfStream, {});
    } else if (item != nullptr) {
      finish(*item, CaptureKind::Failed,
             {ErrorCode::BadData,
              fmt::format("{}: not one of {} frames can be read", sequence_.folder.string(), sequence_.pairs.size())});
    }
  } catch (const std::exception& exception) {
    if (ReplayItem* item = ring_.claim()) {
      finish(*item, CaptureKind::Failed, {ErrorCode::Io, exception.what()});
    }
  }
}

bool ReplayDecoder::run_pass(std::uint64_t pass, std::stop_token stop) {
  bool any_good = false;
  for (std::size_t index = 0; index < sequence_.pairs.size(); ++index) {
    ReplayItem* item = wait_for_room(stop);
    if (item == nullptr) {
      return true;
    }
    decode(pass, index, *item, stop);
    if (stop.stop_requested()) {
      item->frame.reset();
      return true;
    }
    any_good |= item->kind != CaptureKind::SkippedFrame;
    ring_.commit();
    decoded_.notify();
  }
  return any_good;
}

void ReplayDecoder::decode(std::uint64_t pass, std::size_t index, ReplayItem& item, std::stop_token stop) {
  const TumAssociation& pair = sequence_.pairs[index];
  const std::int64_t first_ns = sequence_.pairs.front().color.stamp_ns;
  const std::int64_t pass_ns = sequence_.pairs.back().color.stamp_ns - first_ns + sequence_.period_ns;
  item.elapsed_ns = pair.color.stamp_ns - first_ns + static_cast<std::int64_t>(pass) * pass_ns;
  item.frame.reset();
  item.error = {};

  std::optional<FrameWriter> slot = wait_for_slot(item.elapsed_ns, std::move(stop));
  if (!slot) {
    item.kind = CaptureKind::NoFreeSlot;
    return;
  }
  RgbdFrame& frame = **slot;
  frame.sequence = pass * sequence_.pairs.size() + index;
  frame.stamp_utc_ns = first_ns + item.elapsed_ns;
  frame.depth_offset_ns = pair.depth.stamp_ns - pair.color.stamp_ns;
  if (Status decoded = decode_images(pair, frame); !decoded) {
    item.kind = CaptureKind::SkippedFrame;
    item.error = std::move(decoded.error());
    return;
  }
  item.kind = CaptureKind::Frame;
  item.frame.emplace(std::move(*slot));
}

Status ReplayDecoder::decode_images(const TumAssociation& pair, RgbdFrame& frame) {
  if (Status color = images_.read_color(sequence_.folder / pair.color.image, frame.bgr, frame.gray); !color) {
    return tl::unexpected(at_line(sequence_.color_list, pair.color.line, std::move(color.error())));
  }
  if (Status depth = images_.read_depth(sequence_.folder / pair.depth.image, options_.depth_units_per_metre, frame.depth_m);
      !depth) {
    return tl::unexpected(at_line(sequence_.depth_list, pair.depth.line, std::move(depth.error())));
  }
  return {};
}

void ReplayDecoder::finish(ReplayItem& item, CaptureKind kind, Error error) {
  item.kind = kind;
  item.frame.reset();
  item.error = std::move(error);
  ring_.commit();
  decoded_.notify();
}

ReplayItem* ReplayDecoder::wait_for_room(std::stop_token stop) {
  while (!stop.stop_requested()) {
    const std::uint32_t seen = taken_.generation();
    if (ReplayItem* item = ring_.claim()) {
      return item;
    }
    taken_.wait(seen, kStopSliceNs);
  }
  return nullptr;
}

std::optional<FrameWriter> ReplayDecoder::wait_for_slot(TimeNs elapsed_ns, std::stop_token stop) {
  while (!stop.stop_requested()) {
    if (std::optional<FrameWriter> slot = pool_.acquire()) {
      return slot;
    }
    const TimeNs start_ns = start_ns_.load(std::memory_order_acquire);
    if (!options_.wait_for_slots && start_ns != kNotBegun && clock_.now_ns() >= start_ns + elapsed_ns) {
      return std::nullopt;
    }
    taken_.wait(taken_.generation(), kSlotPollNs);
  }
  return std::nullopt;
}

}  // namespace posed
