#pragma once

#include <cstdint>

namespace posed {

/// Nanoseconds since the epoch of the monotonic clock (CLOCK_MONOTONIC) unless a name says otherwise.
using TimeNs = std::int64_t;

constexpr TimeNs kNsPerUs = 1'000;
constexpr TimeNs kNsPerMs = 1'000'000;
constexpr TimeNs kNsPerSecond = 1'000'000'000;

constexpr double to_ms(TimeNs duration_ns) {
  return static_cast<double>(duration_ns) * 1e-6;
}
constexpr double to_seconds(TimeNs duration_ns) {
  return static_cast<double>(duration_ns) * 1e-9;
}
/// To the nearest nanosecond: 0.033 s is 33,000,000 ns although the double is a little below it.
constexpr TimeNs from_seconds(double seconds) {
  return static_cast<TimeNs>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5));
}

/// The time, injectable so that tests need not wait for it. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;

  virtual TimeNs now_ns() const noexcept = 0;

  /// Blocks the calling thread until `now_ns() >= deadline_ns`.
  virtual void sleep_until(TimeNs deadline_ns) const = 0;

  /// Nanoseconds since 1970-01-01 UTC of the instant `monotonic_ns`: what LCM's users expect in `utime`.
  virtual std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept = 0;
};

/// The machine's own clocks: CLOCK_MONOTONIC and, for UTC, CLOCK_REALTIME sampled at the call. Thread-safe.
class SystemClock final : public Clock {
 public:
  TimeNs now_ns() const noexcept override;
  void sleep_until(TimeNs deadline_ns) const override;
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override;

  /// One clock for the whole process; it has no state.
  static const SystemClock& instance() noexcept;
};

}  // namespace posed
