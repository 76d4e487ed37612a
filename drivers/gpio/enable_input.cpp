#include "drivers/gpio/enable_input.h"

namespace posed {

EnableInput::EnableInput(LineAccess& access, const GpioConfig& config, const HeldLine::ErrorSink& on_error)
    : line_(access, {config.chip, config.enable_line, config.enable_active_low, LineDirection::Input}, on_error) {}

TimeNs EnableInput::step(TimeNs now_ns) {
  GpioLine* const line = line_.get(now_ns);
  if (line == nullptr) {
    return line_.retry_ns();
  }
  if (settled_ns_ && now_ns < *settled_ns_) {
    return *settled_ns_;  // what happens until then is looked at then, so a line that chatters wakes nobody the more for it
  }
  const Result<TimeNs> next_ns = look(*line, now_ns);
  if (!next_ns) {
    settled_ns_.reset();
    line_.lose(next_ns.error(), now_ns);
    return line_.retry_ns();
  }
  return *next_ns;
}

Result<TimeNs> EnableInput::look(GpioLine& line, TimeNs now_ns) {
  const Result<bool> moved = line.take_events();
  if (!moved) {
    return tl::unexpected<Error>(moved.error());
  }
  const Result<bool> active = line.is_active();
  if (!active) {
    return tl::unexpected<Error>(active.error());
  }
  const bool settled = !known_ || (settled_ns_ && !*moved);
  if (settled) {
    active_.store(*active, std::memory_order_relaxed);
    known_ = true;
  }
  // An event can be lost in the kernel's full queue, so the level counts, too.
  if (*moved || *active != is_active()) {
    settled_ns_ = now_ns + kSettle_ns;
    return *settled_ns_;
  }
  settled_ns_.reset();
  return now_ns + (line.event_fd() < 0 ? kPoll_ns : HeldLine::kRecheck_ns);
}

}  // namespace posed
