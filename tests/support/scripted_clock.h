#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "core/clock.h"

namespace posed::test {

/// A clock that jumps to where somebody sleeps to, and lets happen on the way what a test has written down for a time. So code that
/// waits runs at once, in one thread. Thread-bound.
class ScriptedClock final : public Clock {
 public:
  explicit ScriptedClock(TimeNs start_ns = kNsPerSecond) : now_ns_(start_ns) {}

  TimeNs now_ns() const noexcept override { return now_ns_; }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return 1'700'000'000 * kNsPerSecond + monotonic_ns; }

  void sleep_until(TimeNs deadline_ns) const override {
    while (!events_.empty() && events_.begin()->first <= deadline_ns) {
      const auto next = events_.extract(events_.begin());
      now_ns_ = std::max(now_ns_, next.key());
      next.mapped()();
    }
    now_ns_ = std::max(now_ns_, deadline_ns);
  }

  void advance(TimeNs duration_ns) { sleep_until(now_ns_ + duration_ns); }

  /// `event` happens when the time comes; it must not sleep.
  void at(TimeNs time_ns, std::function<void()> event) { events_.emplace(time_ns, std::move(event)); }

 private:
  mutable TimeNs now_ns_;
  mutable std::multimap<TimeNs, std::function<void()>> events_;
};

}  // namespace posed::test
