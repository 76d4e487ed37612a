#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/clock.h"

namespace posed {

/// Maps the stamps of a device's own clock onto the monotonic clock. All that is known of the two is when frames arrive:
/// arrival = offset + (1 + skew) * stamp + delay, where the delay is never negative and now and then small. The line below all
/// arrivals that touches the least delayed ones is estimated (the convex hull's edge below their mean: Moon, Skelly, Towsley 1999,
/// "Estimation and removal of clock skew from network delay measurements"), over the least delayed arrival of each of the last
/// kBins periods. A constant least delay cannot be told from the offset, and stays in the stamps.
/// A counter of 64 bits that wraps around goes on. Thread-bound. Does not allocate.
class DeviceClock {
 public:
  static constexpr std::size_t kBins = 60;
  static constexpr TimeNs kBin_ns = kNsPerSecond;
  static constexpr double kMaxSkew = 500e-6;                ///< of real oscillators; beyond it an estimate is not believed
  static constexpr TimeNs kEarliest_ns = kNsPerSecond / 4;  ///< a frame that arrives sooner before its stamp, or
  static constexpr TimeNs kLatest_ns = 2 * kNsPerSecond;    ///< so long after it, shows that the device's clock was set

  struct Quality {
    TimeNs error_ns = 0;       ///< median distance of the periods' least delayed arrivals from the line
    double skew_ppm = 0;       ///< the device's clock runs slow by so much
    std::uint64_t resets = 0;  ///< stamps that went back or jumped
  };

  /// The monotonic time of `device_ns`, a stamp that arrived at `arrival_ns`; never later than that.
  TimeNs to_monotonic(TimeNs device_ns, TimeNs arrival_ns);

  /// Forgets everything but the count of resets: the device was opened again.
  void restart();

  Quality quality() const;

 private:
  struct Sample {
    TimeNs device_ns = 0;  // since base_ns_
    TimeNs offset_ns = 0;  // arrival - device
  };

  bool was_set(TimeNs since_ns, TimeNs arrival_ns) const;
  TimeNs offset_at(TimeNs since_ns) const;
  void add(const Sample& sample);
  void fit();

  std::array<Sample, kBins> bins_{};  // a ring, oldest first from first_
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::int64_t newest_bin_ = 0;
  TimeNs base_ns_ = 0;  // the device's stamp at the start: what follows counts from it, so that no stamp is too large
  TimeNs last_device_ns_ = 0;

  TimeNs origin_ns_ = 0;  // since base_ns_: where the line has offset_ns_
  TimeNs offset_ns_ = 0;
  double skew_ = 0;  // d offset / d device time
  std::uint64_t resets_ = 0;
};

}  // namespace posed
