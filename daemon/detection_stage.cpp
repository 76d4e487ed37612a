#include "daemon/detection_stage.h"

#include <optional>
#include <utility>

#include "core/logging.h"

namespace posed {

DetectionStage::DetectionStage(FrameDetector* detector, Links links, std::function<void()> wake_publisher, int lockstep_lag,
                               const Clock& clock)
    : detector_(detector),
      links_(links),
      wake_publisher_(std::move(wake_publisher)),
      clock_(clock),
      delayed_(static_cast<std::size_t>(lockstep_lag) + 1) {}

void DetectionStage::run(const std::stop_token& stop) {
  Detections found;
  links_.frames.consume(stop, [&](const RgbdFrame& frame) {
    const HeartbeatScope working(heartbeat_, clock_);
    const Result<DetectionOutcome> outcome = detector_->detect(frame, found);
    note(outcome);
    if (outcome && outcome->finished) {
      links_.tracker.back() = found;
      links_.tracker.publish();
      hand_on(found);
    }
  });
  close_output();
}

void DetectionStage::detect_unhurried(const RgbdFrame& frame, const std::stop_token& stop) {
  Detections found;
  const Result<DetectionOutcome> outcome = detector_->detect_unhurried(frame, found);
  note(outcome);
  const bool finished = outcome && outcome->finished;
  delayed_[next_delayed_] = finished ? found : Detections{};
  next_delayed_ = (next_delayed_ + 1) % delayed_.size();
  links_.tracker.back() = delayed_[next_delayed_];  // the oldest
  links_.tracker.publish();
  if (finished && links_.publisher.wait_for_room(stop)) {
    hand_on(found);
  }
}

void DetectionStage::close_output() {
  links_.publisher.close();
  wake_publisher_();
}

void DetectionStage::hand_on(const Detections& found) {
  if (const std::optional<Detections> oldest = links_.publisher.ring.push(found)) {
    dropped_.add();
  }
  wake_publisher_();
}

void DetectionStage::note(const Result<DetectionOutcome>& outcome) {
  if (!outcome) {
    errors_.add();
    if (!std::exchange(complained_, true)) {
      log_warning("the person detector failed: {}. Tracking goes on; this is said once", outcome.error().message);
    }
    return;
  }
  model_.store(outcome->model, std::memory_order_relaxed);
  (outcome->finished ? detected_ : abandoned_).add();
  detect_time_.record(outcome->elapsed_ns);
  if (outcome->overrun_ns > 0) {
    overrun_.record(outcome->overrun_ns);
  }
}

void DetectionStage::report(HealthReport& health) const {
  if (!is_enabled()) {
    return;
  }
  health.detector_model = detector_->model_name(model_.load(std::memory_order_relaxed));
  health.detected = detected_.value();
  health.detections_abandoned = abandoned_.value();
  health.detections_dropped = dropped_.value();
  health.detector_errors = errors_.value();
  health.detect = detect_time_.summary();
  health.detect_overrun = overrun_.summary();
}

}  // namespace posed
