#pragma once

#include "core/clock.h"
#include "drivers/device_clock.h"

namespace posed {

/// Monotonic times of a camera's images. libcamera promises the monotonic clock; a stamp that cannot be of it (it lies in the
/// future, or longer ago than any pipeline keeps an image) shows that the promise is broken, and from then on the camera's clock is
/// mapped. A camera that stamps nothing gets the time of arrival. Thread-bound. Does not allocate.
class SensorStamps {
 public:
  TimeNs time_of(TimeNs stamp_ns, TimeNs arrival_ns);

  /// The camera was opened again.
  void restart();

  /// How often stamps leapt within a stream.
  std::uint64_t resets() const { return leaps_ + clock_.quality().resets; }
  TimeNs error_ns() const { return is_mapped_ ? clock_.quality().error_ns : 0; }

 private:
  DeviceClock clock_;
  bool is_mapped_ = false;
  bool any_ = false;
  std::uint64_t leaps_ = 0;  // of stamps that had been true until then
};

}  // namespace posed
