#include "daemon/publish_stage.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace posed {

namespace {

constexpr TimeNs kLongestSleepNs = kNsPerSecond;

}  // namespace

PublishStage::PublishStage(Inputs in, std::unique_ptr<Publisher> publisher, Observers observers, const Clock& clock)
    : in_(in), publisher_(std::move(publisher)), observers_(std::move(observers)), clock_(clock) {}

void PublishStage::run(const std::stop_token& stop, const std::function<void()>& on_drained) {
  bool drained = false;
  while (!stop.stop_requested()) {
    heartbeat_.beat(clock_.now_ns());
    const std::uint32_t seen = in_.estimates.generation();
    const bool was_closed = in_.estimates.is_closed() && in_.detections.is_closed();
    const TimeNs due_ns = publisher_ ? publisher_->do_due_work() : clock_.now_ns() + kLongestSleepNs;
    if (step()) {
      continue;
    }
    if (was_closed && !drained) {
      drained = true;
      if (publisher_) {
        publisher_->publish_status();
      }
      on_drained();
    }
    heartbeat_.rest();
    in_.estimates.wait_arrived(seen, std::clamp<TimeNs>(due_ns - clock_.now_ns(), 0, kLongestSleepNs));
  }
  if (publisher_) {
    publisher_->publish_status();
  }
}

bool PublishStage::step() {
  return publish_estimate() || publish_detections();
}

bool PublishStage::publish_estimate() {
  const std::optional<PoseEstimate> estimate = in_.estimates.ring.pop();
  if (!estimate) {
    return false;
  }
  in_.estimates.notify_taken();
  const TimeNs publish_ns = clock_.now_ns();
  latency_.record(publish_ns - estimate->capture_ns);
  if (publisher_) {
    publisher_->publish(*estimate, publish_ns);
  }
  if (observers_.on_estimate) {
    observers_.on_estimate(*estimate);
  }
  return true;
}

bool PublishStage::publish_detections() {
  const std::optional<Detections> detections = in_.detections.ring.pop();
  if (!detections) {
    return false;
  }
  in_.detections.notify_taken();
  if (publisher_) {
    publisher_->publish(*detections, clock_.now_ns());
  }
  if (observers_.on_detections) {
    observers_.on_detections(*detections);
  }
  return true;
}

void PublishStage::set_status_period(TimeNs period_ns) noexcept {
  if (publisher_) {
    publisher_->set_status_period(period_ns);
  }
}

void PublishStage::report(HealthReport& health) const {
  health.latency = latency_.summary();
  if (publisher_) {
    publisher_->report(health);
  }
}

}  // namespace posed
