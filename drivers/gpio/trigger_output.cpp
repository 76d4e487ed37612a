#include "drivers/gpio/trigger_output.h"

#include <algorithm>
#include <cmath>

namespace posed {

TriggerOutput::TriggerOutput(LineAccess& access, const GpioConfig& config, const Clock& clock, const HeldLine::ErrorSink& on_error)
    : line_(access, {config.chip, config.trigger_line, config.trigger_active_low, LineDirection::Output}, on_error),
      clock_(clock),
      period_ns_(static_cast<double>(kNsPerSecond) / config.trigger_rate_hz) {}

TimeNs TriggerOutput::step(TimeNs now_ns) {
  GpioLine* const line = line_.get(now_ns);
  if (line == nullptr) {
    return line_.retry_ns();
  }
  if (!first_ns_) {
    first_ns_ = now_ns;
    next_pulse_ = 0;
  }
  Status done;
  if (end_ns_ && now_ns >= *end_ns_) {
    done = line->set_active(false);
    end_ns_.reset();
    earliest_ns_ = now_ns + kPulse_ns;
  }
  if (done && !end_ns_ && now_ns >= begin_ns()) {
    done = begin_pulse(*line, now_ns);
  }
  if (!done) {
    line_.lose(done.error(), now_ns);
    first_ns_.reset();
    end_ns_.reset();
    return line_.retry_ns();
  }
  return end_ns_ ? *end_ns_ : begin_ns();
}

TimeNs TriggerOutput::due_ns(std::uint64_t pulse) const {
  return *first_ns_ + std::llround(static_cast<double>(pulse) * period_ns_);
}

TimeNs TriggerOutput::begin_ns() const {
  return std::max(due_ns(next_pulse_), earliest_ns_);
}

Status TriggerOutput::begin_pulse(GpioLine& line, TimeNs now_ns) {
  // Where whole periods have gone by, only the newest pulse is made up for.
  const auto newest = std::max(next_pulse_, static_cast<std::uint64_t>(static_cast<double>(now_ns - *first_ns_) / period_ns_));
  missed_.add(newest - next_pulse_);
  const TimeNs before_ns = clock_.now_ns();
  if (Status set = line.set_active(true); !set) {
    return set;
  }
  const TimeNs edge_ns = before_ns + (clock_.now_ns() - before_ns) / 2;  // it lies somewhere in the call
  const TimeNs lateness_ns = edge_ns - due_ns(newest);
  next_pulse_ = newest + 1;
  end_ns_ = edge_ns + kPulse_ns;
  pulses_.add();
  last_ns_.set(edge_ns);
  worst_lateness_ns_.set(std::max(worst_lateness_ns_.value(), lateness_ns));
  return {};
}

void TriggerOutput::finish(TimeNs now_ns) {
  if (line_.is_held()) {
    // A line that fails now is not wanted any more.
    (void)line_.get(now_ns)->set_active(false);
  }
}

void TriggerOutput::report(GpioHealth& health) const noexcept {
  health.trigger_pulses = pulses_.value();
  health.trigger_missed = missed_.value();
  health.last_trigger_ns = last_ns_.value();
  health.worst_trigger_lateness_ns = worst_lateness_ns_.value();
}

}  // namespace posed
