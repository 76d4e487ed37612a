#pragma once

#include <atomic>
#include <cstddef>
#include <stop_token>

#include "core/bounded_ring.h"
#include "core/clock.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/frame_pool.h"
#include "core/latest_value.h"
#include "core/overflow_ring.h"
#include "core/wake_event.h"
#include "slam/keyframe_record.h"

namespace posed {

/// The joint between two stages of the pipeline: a ring, the wake-up of whoever sleeps on it, and its end. Who may call what
/// follows the ring: exactly one producer thread and one consumer thread. Nothing here blocks but `wait_*`.
template <typename Ring>
class StageLink {
 public:
  explicit StageLink(std::size_t capacity) : ring(capacity), capacity_(capacity) {}

  Ring ring;

  /// Producer: after each element that was put into the ring.
  void notify_arrived() noexcept { arrived_.notify(); }

  /// Producer: nothing follows.
  void close() noexcept {
    closed_.store(true, std::memory_order_release);
    arrived_.notify();
  }

  /// Consumer: after each element that was taken from the ring.
  void notify_taken() noexcept { taken_.notify(); }

  /// Anyone: makes both sides look at their stop tokens.
  void wake_all() noexcept {
    arrived_.notify();
    taken_.notify();
  }

  /// Producer. Sleeps until the ring has room; false where `stop` was requested first.
  bool wait_for_room(const std::stop_token& stop) noexcept {
    while (!stop.stop_requested()) {
      const std::uint32_t seen = taken_.generation();
      if (ring.size() < capacity_) {
        return true;
      }
      taken_.wait(seen, kPatienceNs);
    }
    return false;
  }

  /// Consumer. Calls `step` until a stop is requested or the producer has closed the link and all of it was consumed; true for the
  /// latter. `step` takes one element and says whether there was one; while there is none the thread sleeps.
  template <typename Step>
  bool consume(const std::stop_token& stop, Step&& step) {
    while (!stop.stop_requested()) {
      const std::uint32_t seen = arrived_.generation();
      const bool was_closed = is_closed();  // before looking: what came before the end is then seen
      if (step()) {
        continue;
      }
      if (was_closed) {
        return true;
      }
      arrived_.wait(seen, kPatienceNs);
    }
    return false;
  }

  std::uint32_t generation() const noexcept { return arrived_.generation(); }
  bool is_closed() const noexcept { return closed_.load(std::memory_order_acquire); }

  /// Consumer. Sleeps until something arrived after `generation()` was `seen`, the link was closed, or the time is over.
  void wait_arrived(std::uint32_t seen, TimeNs timeout_ns) noexcept { arrived_.wait(seen, timeout_ns); }

 private:
  static constexpr TimeNs kPatienceNs = kNsPerSecond;  // a stop wakes all links, so this bounds nothing but the cost of a bug

  std::size_t capacity_;
  WakeEvent arrived_;
  WakeEvent taken_;
  std::atomic<bool> closed_{false};
};

/// The joint between the capture thread and a stage that wants the newest frame alone. It holds up to three frames of the pool.
class NewestFrameLink {
 public:
  static constexpr int kFramesHeld = 3;

  /// Producer. Never waits.
  void push(const FrameRef& frame) noexcept {
    frames_.back() = frame;
    frames_.publish();
    arrived_.notify();
  }

  /// Producer: nothing follows.
  void close() noexcept {
    closed_.store(true, std::memory_order_release);
    arrived_.notify();
  }

  /// Anyone: makes the consumer look at its stop token.
  void wake() noexcept { arrived_.notify(); }

  /// Consumer. Calls `look` with the newest frame whenever there is one that was not looked at, until a stop is requested or the
  /// producer has closed the link and the last frame was looked at.
  template <typename Look>
  void consume(const std::stop_token& stop, Look&& look) {
    while (!stop.stop_requested()) {
      const std::uint32_t seen = arrived_.generation();
      const bool was_closed = closed_.load(std::memory_order_acquire);
      if (frames_.refresh()) {
        look(*frames_.front());
      } else if (was_closed) {
        return;
      } else {
        arrived_.wait(seen, kNsPerSecond);
      }
    }
  }

 private:
  LatestValue<FrameRef> frames_;
  WakeEvent arrived_;
  std::atomic<bool> closed_{false};
};

using FrameLink = StageLink<OverflowRing<FrameRef>>;
using KeyframeLink = StageLink<BoundedRing<KeyframeRecord>>;
using EstimateLink = StageLink<OverflowRing<PoseEstimate>>;
using DetectionsLink = StageLink<OverflowRing<Detections>>;

}  // namespace posed
