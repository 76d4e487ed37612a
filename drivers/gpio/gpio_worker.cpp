#include "drivers/gpio/gpio_worker.h"

#include <algorithm>
#include <utility>

namespace posed {

GpioWorker::GpioWorker(const GpioConfig& config, std::unique_ptr<LineAccess> access, const Clock& clock,
                       HeldLine::ErrorSink on_error)
    : clock_(clock), on_error_(std::move(on_error)), access_(std::move(access)) {
  if (config.status_line >= 0) {
    light_.emplace(*access_, config, on_error_);
  }
  if (config.enable_line >= 0) {
    enable_.emplace(*access_, config, on_error_);
  }
  if (config.trigger_line >= 0) {
    trigger_.emplace(*access_, config, clock, on_error_);
  }
}

TimeNs GpioWorker::step() {
  TimeNs next_ns = kNever_ns;
  if (trigger_) {  // first, since it alone is exact
    next_ns = trigger_->step(clock_.now_ns());
  }
  if (enable_) {
    next_ns = std::min(next_ns, enable_->step(clock_.now_ns()));
  }
  if (light_) {
    next_ns = std::min(next_ns, light_->step(clock_.now_ns()));
  }
  return next_ns;
}

void GpioWorker::finish() {
  if (trigger_) {
    trigger_->finish(clock_.now_ns());
  }
  if (light_) {
    light_->finish(clock_.now_ns());
  }
}

GpioHealth GpioWorker::health() const noexcept {
  GpioHealth health;
  health.ok = (!light_ || light_->is_held()) && (!enable_ || enable_->is_held()) && (!trigger_ || trigger_->is_held());
  if (trigger_) {
    trigger_->report(health);
  }
  return health;
}

}  // namespace posed
