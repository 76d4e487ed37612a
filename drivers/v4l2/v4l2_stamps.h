#pragma once

#include <cstdint>

#include <linux/videodev2.h>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/device_clock.h"

namespace posed {

/// Monotonic times of a stream's images. Stamps that the driver flags as monotonic are used as they are, until one shows that they
/// are not: one that goes back, lies in the future or is negative. Those, and stamps of any other clock, go through DeviceClock. A
/// driver that stamps nothing gets the time of arrival. Thread-bound. Does not allocate but for errors.
class V4l2Stamps {
 public:
  /// The stream begins anew.
  void restart();

  /// When the image in `buffer` was taken, always later than the one before; BadData where it is not.
  Result<TimeNs> time_of(const v4l2_buffer& buffer, TimeNs arrival_ns);

  /// How often stamps leapt within a stream.
  std::uint64_t resets() const { return leaps_ + clock_.quality().resets; }
  TimeNs error_ns() const { return on_device_clock_ ? clock_.quality().error_ns : 0; }

 private:
  DeviceClock clock_;
  bool on_device_clock_ = false;
  bool any_ = false;
  TimeNs last_ns_ = 0;
  std::uint64_t leaps_ = 0;  // of stamps that had been true until then
};

}  // namespace posed
