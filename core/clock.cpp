#include "core/clock.h"

#include <cerrno>
#include <ctime>

namespace posed {

namespace {

std::int64_t read_clock(clockid_t id) noexcept {
  timespec t{};
  clock_gettime(id, &t);
  return static_cast<std::int64_t>(t.tv_sec) * kNsPerSecond + t.tv_nsec;
}

}  // namespace

TimeNs SystemClock::now_ns() const noexcept {
  return read_clock(CLOCK_MONOTONIC);
}

void SystemClock::sleep_until(TimeNs deadline_ns) const {
  const timespec t{deadline_ns / kNsPerSecond, deadline_ns % kNsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

std::int64_t SystemClock::utc_ns(TimeNs monotonic_ns) const noexcept {
  return read_clock(CLOCK_REALTIME) + (monotonic_ns - read_clock(CLOCK_MONOTONIC));
}

const SystemClock& SystemClock::instance() noexcept {
  static const SystemClock clock;
  return clock;
}

}  // namespace posed
