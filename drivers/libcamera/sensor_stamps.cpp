#include "drivers/libcamera/sensor_stamps.h"

namespace posed {

namespace {

constexpr TimeNs kAhead_ns = 5 * kNsPerMs;  // by the ways in which drivers compute stamps
constexpr TimeNs kBehind_ns = 2 * kNsPerSecond;

}  // namespace

TimeNs SensorStamps::time_of(TimeNs stamp_ns, TimeNs arrival_ns) {
  if (stamp_ns <= 0) {
    return arrival_ns;
  }
  if (!is_mapped_ && (stamp_ns > arrival_ns + kAhead_ns || stamp_ns < arrival_ns - kBehind_ns)) {
    is_mapped_ = true;
    leaps_ += any_ ? 1 : 0;
  }
  any_ = true;
  return is_mapped_ ? clock_.to_monotonic(stamp_ns, arrival_ns) : stamp_ns;
}

void SensorStamps::restart() {
  clock_.restart();
  is_mapped_ = false;
  any_ = false;
}

}  // namespace posed
