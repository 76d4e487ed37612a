#pragma once

#include "core/clock.h"

namespace posed {

/// A clock that jumps to where somebody sleeps to, so that code which waits by it runs at once, in one thread. Thread-bound.
class SteppingClock final : public Clock {
 public:
  explicit SteppingClock(TimeNs start_ns = kNsPerSecond) : now_ns_(start_ns) {}

  TimeNs now_ns() const noexcept override { return now_ns_; }
  void sleep_until(TimeNs deadline_ns) const override { now_ns_ = deadline_ns > now_ns_ ? deadline_ns : now_ns_; }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return utc_of_zero_ns_ + monotonic_ns; }

  void advance(TimeNs duration_ns) { now_ns_ += duration_ns; }
  void set_utc_of_zero(std::int64_t utc_ns) { utc_of_zero_ns_ = utc_ns; }

 private:
  mutable TimeNs now_ns_;
  std::int64_t utc_of_zero_ns_ = 1'700'000'000 * kNsPerSecond;
};

}  // namespace posed
