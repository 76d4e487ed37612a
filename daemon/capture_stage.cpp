#include "daemon/capture_stage.h"

#include <optional>
#include <utility>

namespace posed {

CaptureStage::CaptureStage(RgbdSource& source, FramePool& pool, std::function<void(const Error&)> on_error)
    : source_(source), pool_(pool), on_error_(std::move(on_error)) {}

bool CaptureStage::begin() {
  const Status started = source_.start(pool_);
  if (!started) {
    fail(started.error());
  }
  return started.has_value();
}

bool CaptureStage::next(const std::stop_token& stop, FrameRef& frame) {
  Capture capture = source_.next(stop);
  switch (capture.kind) {
    case CaptureKind::Frame:
      captured_.add();
      count_missed(capture.frame->sequence);
      if (paused_.load(std::memory_order_relaxed)) {
        let_go_.add();
      } else {
        frame = std::move(capture.frame);
      }
      return true;
    case CaptureKind::SkippedFrame:
      skipped_.add();
      ++explained_gap_;
      if (on_error_) {
        on_error_(capture.error);
      }
      return true;
    case CaptureKind::Interrupted:
      if (on_error_) {
        on_error_(capture.error);
      }
      return true;
    case CaptureKind::NoFreeSlot:
      no_slot_.add();
      ++explained_gap_;
      return true;
    case CaptureKind::EndOfStream: ended_.store(true, std::memory_order_relaxed); return false;
    case CaptureKind::Stopped: return false;
    case CaptureKind::Failed: fail(capture.error); return false;
  }
  return false;
}

void CaptureStage::run(const std::stop_token& stop, FrameLink& out, NewestFrameLink& newest) {
  bool more = begin();
  while (more && !stop.stop_requested()) {
    FrameRef frame;
    more = next(stop, frame);
    if (frame) {
      newest.push(frame);
      if (const std::optional<FrameRef> oldest = out.ring.push(std::move(frame))) {
        dropped_.add();
      }
      out.notify_arrived();
    }
  }
  out.close();
  newest.close();
}

void CaptureStage::report(HealthReport& health) const {
  health.source_failed = failed_.load(std::memory_order_relaxed);
  health.source_ended = ended_.load(std::memory_order_relaxed);
  health.source = source_.health();
  health.paused = paused_.load(std::memory_order_relaxed);
  health.frames_captured = captured_.value();
  health.frames_skipped = skipped_.value();
  health.frames_missed = missed_.value();
  health.frames_no_slot = no_slot_.value();
  health.frames_paused = let_go_.value();
  health.frames_dropped = dropped_.value();
}

void CaptureStage::count_missed(std::uint64_t sequence) {
  if (sequence > next_sequence_ + explained_gap_) {
    missed_.add(sequence - next_sequence_ - explained_gap_);
  }
  next_sequence_ = sequence + 1;
  explained_gap_ = 0;
}

void CaptureStage::fail(const Error& error) {
  failed_.store(true, std::memory_order_relaxed);
  if (on_error_) {
    on_error_(error);
  }
}

}  // namespace posed
