#pragma once

#include <memory>
#include <optional>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "drivers/gpio/enable_input.h"
#include "drivers/gpio/line_access.h"
#include "drivers/gpio/status_light.h"
#include "drivers/gpio/trigger_output.h"
#include "drivers/gpio_lines.h"

namespace posed {

/// What the thread of the GPIO lines does, without the thread. `step` and `finish` are bound to that thread; the rest is
/// thread-safe.
class GpioWorker {
 public:
  /// `clock` must outlive it. `on_error` hears why a line is away, once for each new reason.
  GpioWorker(const GpioConfig& config, std::unique_ptr<LineAccess> access, const Clock& clock, HeldLine::ErrorSink on_error);

  /// Does all that is due now; when to call again, kNever_ns where nothing is to be done.
  TimeNs step();

  /// Where this is readable, a step is due before its time; -1: never.
  int event_fd() const { return enable_ ? enable_->event_fd() : -1; }

  /// Leaves the outputs inactive.
  void finish();

  /// True where this is news, and `step` should come soon.
  bool show(LightState state) noexcept { return light_ && light_->show(state); }
  bool enabled() const noexcept { return !enable_ || enable_->is_active(); }
  GpioHealth health() const noexcept;

 private:
  const Clock& clock_;
  HeldLine::ErrorSink on_error_;
  std::unique_ptr<LineAccess> access_;
  std::optional<StatusLight> light_;  // those that are configured
  std::optional<EnableInput> enable_;
  std::optional<TriggerOutput> trigger_;
};

}  // namespace posed
