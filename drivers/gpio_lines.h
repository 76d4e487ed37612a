#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "core/thread.h"

namespace posed {

/// What the status light shows.
enum class LightState { WaitingForCamera, Initializing, Tracking, Lost, Paused };

/// How the lines fare. Counters only grow. Plain data.
struct GpioHealth {
  bool ok = true;                        ///< every configured line is held
  std::uint64_t trigger_pulses = 0;      ///< given
  std::uint64_t trigger_missed = 0;      ///< left out because the next one was due already
  TimeNs last_trigger_ns = 0;            ///< when the newest pulse began; 0 before the first
  TimeNs worst_trigger_lateness_ns = 0;  ///< of the begin of a pulse, behind its time
  bool operator==(const GpioHealth&) const = default;
};

/// The lines of a GPIO chip: status light, enable input, trigger for the camera (docs/gpio.md). They are worked by a thread of
/// their own, so no call here waits for the hardware. A line that is missing, taken or vanishes is asked for again every second.
/// Thread-safe; the destructor, for the owner alone, turns the outputs inactive and gives the lines back.
class GpioLines {
 public:
  virtual ~GpioLines() = default;

  virtual void show(LightState state) noexcept = 0;

  /// The settled level of the enable input; true where none is configured. It is false until the input was read for the first
  /// time, and keeps its last value while the input cannot be read.
  virtual bool enabled() const noexcept = 0;

  virtual GpioHealth health() const noexcept = 0;
};

/// Starts the thread. `on_error` is called on it when a line is lost or cannot be had, once for each new reason, and must not
/// block. `clock` must outlive the lines. Error: Unsupported, where the build has no GPIO.
Result<std::unique_ptr<GpioLines>> make_gpio_lines(const GpioConfig& config, ThreadOptions thread, const Clock& clock,
                                                   std::function<void(const Error&)> on_error);

}  // namespace posed
