#include "daemon/publish_stage.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace posed {

namespace {

constexpr TimeNs kLongestSleepNs = kNsPerSecond;

}  // namespace

PublishStage::PublishStage(EstimateLink& in, std::unique_ptr<Publisher> publisher,
                           std::function<void(const PoseEstimate&)> on_estimate, const Clock& clock)
    : in_(in), publisher_(std::move(publisher)), on_estimate_(std::move(on_estimate)), clock_(clock) {}

void PublishStage::run(const std::stop_token& stop, const std::function<void()>& on_drained) {
  bool drained = false;
  while (!stop.stop_requested()) {
    const std::uint32_t seen = in_.generation();
    const bool was_closed = in_.is_closed();
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
    in_.wait_arrived(seen, std::clamp<TimeNs>(due_ns - clock_.now_ns(), 0, kLongestSleepNs));
  }
  if (publisher_) {
    publisher_->publish_status();
  }
}

bool PublishStage::step() {
  const std::optional<PoseEstimate> estimate = in_.ring.pop();
  if (!estimate) {
    return false;
  }
  in_.notify_taken();
  const TimeNs publish_ns = clock_.now_ns();
  latency_.record(publish_ns - estimate->capture_ns);
  if (publisher_) {
    publisher_->publish(*estimate, publish_ns);
  }
  if (on_estimate_) {
    on_estimate_(*estimate);
  }
  return true;
}

void PublishStage::report(HealthReport& health) const {
  health.latency = latency_.summary();
  if (publisher_) {
    publisher_->report(health);
  }
}

}  // namespace posed
