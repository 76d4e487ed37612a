#pragma once

#include <array>
#include <atomic>

#include "config/camera_source_config.h"
#include "drivers/gpio/blink_pattern.h"
#include "drivers/gpio/held_line.h"
#include "drivers/gpio_lines.h"

namespace posed {

/// Blinks the status line by the state it was told last. Thread-bound, but for `show` and `is_held`, which are thread-safe.
class StatusLight {
 public:
  StatusLight(LineAccess& access, const GpioConfig& config, const HeldLine::ErrorSink& on_error);

  /// True where this is news.
  bool show(LightState state) noexcept { return told_.exchange(state, std::memory_order_relaxed) != state; }

  /// Does what is due; when to call again.
  TimeNs step(TimeNs now_ns);

  /// Leaves the line dark.
  void finish(TimeNs now_ns);

  bool is_held() const noexcept { return line_.is_held(); }

 private:
  const BlinkPattern& pattern() const { return patterns_[static_cast<std::size_t>(state_)]; }

  HeldLine line_;
  std::array<BlinkPattern, 5> patterns_;  // by LightState
  std::atomic<LightState> told_{LightState::WaitingForCamera};

  LightState state_ = LightState::WaitingForCamera;
  TimeNs begin_ns_ = kNever_ns;  // of the pattern; kNever_ns: it has not begun
  bool on_ = false;
  TimeNs recheck_ns_ = 0;
};

}  // namespace posed
