#pragma once

#include <optional>

#include "config/camera_source_config.h"
#include "core/metrics.h"
#include "drivers/gpio/held_line.h"
#include "drivers/gpio_lines.h"

namespace posed {

/// Gives a pulse for each frame that the camera is to take, at multiples of the period from the first one on, so that no lateness
/// adds up. Thread-bound, but for `report` and `is_held`, which are thread-safe.
class TriggerOutput {
 public:
  static constexpr TimeNs kPulse_ns = kNsPerMs;  ///< and the least time between two; less than half of the shortest period

  TriggerOutput(LineAccess& access, const GpioConfig& config, const Clock& clock, const HeldLine::ErrorSink& on_error);

  /// Begins or ends a pulse where that is due; when to call again.
  TimeNs step(TimeNs now_ns);

  /// Leaves the line inactive.
  void finish(TimeNs now_ns);

  void report(GpioHealth& health) const noexcept;
  bool is_held() const noexcept { return line_.is_held(); }

 private:
  TimeNs due_ns(std::uint64_t pulse) const;
  TimeNs begin_ns() const;  // of the next pulse
  Status begin_pulse(GpioLine& line, TimeNs now_ns);

  HeldLine line_;
  const Clock& clock_;
  double period_ns_;
  std::optional<TimeNs> first_ns_;  // pulse 0 since the line is held
  std::uint64_t next_pulse_ = 0;
  std::optional<TimeNs> end_ns_;  // of the pulse that has begun
  TimeNs earliest_ns_ = 0;        // begin of the next one, however late the last one ended

  Counter pulses_;
  Counter missed_;
  Gauge last_ns_;
  Gauge worst_lateness_ns_;
};

}  // namespace posed
