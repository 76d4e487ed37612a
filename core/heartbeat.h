#pragma once

#include <atomic>

#include "core/clock.h"

namespace posed {

/// Shows others whether a thread is stuck: it beats as it gets on, and rests where nothing is expected of it. Thread-safe: one
/// thread beats, any looks. Lock-free.
class Heartbeat {
 public:
  /// Called at each step, and while waiting for something that may take long.
  void beat(TimeNs now_ns) noexcept { last_ns_.store(now_ns, std::memory_order_relaxed); }

  /// There is nothing to do, for as long as it takes.
  void rest() noexcept { last_ns_.store(kResting, std::memory_order_relaxed); }

  /// Time since the last beat; 0 for a thread that rests.
  TimeNs silent_ns(TimeNs now_ns) const noexcept {
    const TimeNs last_ns = last_ns_.load(std::memory_order_relaxed);
    return last_ns == kResting || now_ns < last_ns ? 0 : now_ns - last_ns;
  }

 private:
  static constexpr TimeNs kResting = -1;
  std::atomic<TimeNs> last_ns_{kResting};
};

/// Beats when work begins and rests when it ends.
class HeartbeatScope {
 public:
  HeartbeatScope(Heartbeat& heartbeat, const Clock& clock) noexcept : heartbeat_(heartbeat) { heartbeat_.beat(clock.now_ns()); }
  ~HeartbeatScope() { heartbeat_.rest(); }
  HeartbeatScope(const HeartbeatScope&) = delete;
  HeartbeatScope& operator=(const HeartbeatScope&) = delete;

 private:
  Heartbeat& heartbeat_;
};

}  // namespace posed
