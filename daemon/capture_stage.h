#pragma once

#include <atomic>
#include <functional>
#include <stop_token>

#include "core/frame_pool.h"
#include "core/metrics.h"
#include "core/result.h"
#include "daemon/health.h"
#include "daemon/stage_link.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// Takes frames from the source and counts what becomes of them. Thread-bound to the capture thread, but for `report` and
/// `set_paused`, which are thread-safe. After the source's start it neither allocates nor locks, but for what `on_error` does,
/// which only errors cause.
class CaptureStage {
 public:
  /// `source` and `pool` must outlive the stage. `on_error` may be empty.
  CaptureStage(RgbdSource& source, FramePool& pool, std::function<void(const Error&)> on_error);

  /// Starts the source; false where it failed.
  bool begin();

  /// While paused, frames are taken from the source, counted, and let go, so that the device runs on.
  void set_paused(bool paused) noexcept { paused_.store(paused, std::memory_order_relaxed); }

  /// The source's next frame, into `frame`, which is empty where this one was lost or let go; false at the end, on failure and on
  /// `stop`.
  bool next(const std::stop_token& stop, FrameRef& frame);

  /// The thread's body in real time: every frame goes into `out`, whose oldest makes way, and is the newest in `newest`; both are
  /// closed at the end.
  void run(const std::stop_token& stop, FrameLink& out, NewestFrameLink& newest);

  void report(HealthReport& health) const;

 private:
  void fail(const Error& error);
  void count_missed(std::uint64_t sequence);

  RgbdSource& source_;
  FramePool& pool_;
  std::function<void(const Error&)> on_error_;

  Counter captured_;
  Counter skipped_;
  Counter no_slot_;
  Counter dropped_;
  Counter missed_;
  Counter let_go_;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t explained_gap_ = 0;  // frames since the last delivered one that were skipped or had no slot
  std::atomic<bool> paused_{false};
  std::atomic<bool> failed_{false};
  std::atomic<bool> ended_{false};
};

}  // namespace posed
