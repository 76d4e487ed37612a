#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <iterator>
#include <set>

#include "core/clock.h"
#include "core/mutex.h"

namespace posed {

/// A clock that moves only when a test says so. `sleep_until` blocks until `advance` has carried the time past the deadline, so a
/// thread under test waits without any real time passing. Thread-safe.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(TimeNs start_ns = 0, std::int64_t utc_of_zero_ns = 0) : now_ns_(start_ns), utc_of_zero_ns_(utc_of_zero_ns) {}

  TimeNs now_ns() const noexcept override { return now_ns_.load(); }

  void sleep_until(TimeNs deadline_ns) const override {
    MutexLock lock(mutex_);
    const auto sleeper = deadlines_ns_.insert(deadline_ns);
    changed_.notify_all();
    while (now_ns_.load() < deadline_ns) {
      changed_.wait(mutex_);
    }
    deadlines_ns_.erase(sleeper);
  }

  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return utc_of_zero_ns_ + monotonic_ns; }

  void advance(TimeNs duration_ns) {
    MutexLock lock(mutex_);
    now_ns_.fetch_add(duration_ns);
    changed_.notify_all();
  }

  /// Waits until `count` threads sleep towards a deadline that is still to come: only `advance` wakes them.
  void wait_for_sleepers(std::ptrdiff_t count) const {
    MutexLock lock(mutex_);
    while (std::distance(deadlines_ns_.upper_bound(now_ns_.load()), deadlines_ns_.end()) < count) {
      changed_.wait(mutex_);
    }
  }

 private:
  mutable Mutex mutex_;
  mutable std::condition_variable_any changed_;
  mutable std::multiset<TimeNs> deadlines_ns_ POSED_GUARDED_BY(mutex_);
  std::atomic<TimeNs> now_ns_;
  const std::int64_t utc_of_zero_ns_;
};

}  // namespace posed
