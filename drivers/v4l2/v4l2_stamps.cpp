#include "drivers/v4l2/v4l2_stamps.h"

#include <cstdint>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr TimeNs kAhead_ns = 5 * kNsPerMs;  // a monotonic stamp may be, by the ways in which drivers compute them

/// Of any bits that a driver gives: what is too large wraps around.
TimeNs stamp_of(const v4l2_buffer& buffer) {
  return static_cast<TimeNs>(static_cast<std::uint64_t>(buffer.timestamp.tv_sec) * static_cast<std::uint64_t>(kNsPerSecond) +
                             static_cast<std::uint64_t>(buffer.timestamp.tv_usec) * static_cast<std::uint64_t>(kNsPerUs));
}

}  // namespace

void V4l2Stamps::restart() {
  clock_.restart();
  on_device_clock_ = false;
  any_ = false;
}

Result<TimeNs> V4l2Stamps::time_of(const v4l2_buffer& buffer, TimeNs arrival_ns) {
  const TimeNs stamp_ns = stamp_of(buffer);
  const bool said_monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!on_device_clock_ &&
      (!said_monotonic || stamp_ns < 0 || stamp_ns > arrival_ns + kAhead_ns || (any_ && stamp_ns < last_ns_))) {
    on_device_clock_ = true;
    leaps_ += any_ ? 1 : 0;
  }
  TimeNs time_ns = stamp_ns;
  if (on_device_clock_) {
    time_ns = stamp_ns == 0 ? arrival_ns : clock_.to_monotonic(stamp_ns, arrival_ns);
  }
  if (any_ && time_ns <= last_ns_) {
    return make_error(ErrorCode::BadData,
                      fmt::format("its stamp is {:.6f} s before that of the image before it", to_seconds(last_ns_ - time_ns)));
  }
  any_ = true;
  last_ns_ = time_ns;
  return time_ns;
}

}  // namespace posed
