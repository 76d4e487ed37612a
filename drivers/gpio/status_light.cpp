#include "drivers/gpio/status_light.h"

#include <algorithm>

namespace posed {

StatusLight::StatusLight(LineAccess& access, const GpioConfig& config, const HeldLine::ErrorSink& on_error)
    : line_(access, {config.chip, config.status_line, config.status_active_low, LineDirection::Output}, on_error),
      patterns_{BlinkPattern(config.waiting_ms), BlinkPattern(config.initializing_ms), BlinkPattern(config.tracking_ms),
                BlinkPattern(config.lost_ms), BlinkPattern(config.paused_ms)} {}

TimeNs StatusLight::step(TimeNs now_ns) {
  const LightState told = told_.load(std::memory_order_relaxed);
  if (told != state_ || begin_ns_ == kNever_ns) {
    state_ = told;
    begin_ns_ = now_ns;
  }
  const bool was_held = line_.is_held();
  GpioLine* const line = line_.get(now_ns);
  if (line == nullptr) {
    return line_.retry_ns();
  }
  const TimeNs elapsed_ns = now_ns - begin_ns_;
  const bool on = pattern().is_on(elapsed_ns);
  if (!was_held || on != on_ || now_ns >= recheck_ns_) {
    if (const Status set = line->set_active(on); !set) {
      line_.lose(set.error(), now_ns);
      return line_.retry_ns();
    }
    on_ = on;
    recheck_ns_ = now_ns + HeldLine::kRecheck_ns;
  }
  const TimeNs change_ns = pattern().next_change_ns(elapsed_ns);
  return change_ns == kNever_ns ? recheck_ns_ : std::min(begin_ns_ + change_ns, recheck_ns_);
}

void StatusLight::finish(TimeNs now_ns) {
  if (line_.is_held()) {
    // A line that fails now is not wanted any more.
    (void)line_.get(now_ns)->set_active(false);
  }
}

}  // namespace posed
