#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "core/clock.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/heartbeat.h"
#include "core/metrics.h"
#include "daemon/health.h"
#include "daemon/publisher.h"
#include "daemon/stage_link.h"

namespace posed {

/// The end of the pipeline: publishes estimates in their order and shows them to whoever asked. liblcm takes locks and may block,
/// which is why this has a thread to itself. Thread-bound to the publisher thread, but for `report`, which is thread-safe.
class PublishStage {
 public:
  struct Inputs {
    EstimateLink& estimates;
    DetectionsLink& detections;  ///< whoever fills it wakes `estimates`
  };
  /// Show what was published to whoever asked; each may be empty.
  struct Observers {
    std::function<void(const PoseEstimate&)> on_estimate;
    std::function<void(const Detections&)> on_detections;
  };

  /// `publisher` may be null: nothing is sent. The links and `clock` must outlive the stage.
  PublishStage(Inputs in, std::unique_ptr<Publisher> publisher, Observers observers, const Clock& clock);

  /// The thread's body. Calls `on_drained` once, when both inputs have ended and all is published; status goes on until `stop`.
  void run(const std::stop_token& stop, const std::function<void()>& on_drained);

  void report(HealthReport& health) const;

  /// Thread-safe.
  void set_status_period(TimeNs period_ns) noexcept;
  const Heartbeat& heartbeat() const { return heartbeat_; }

 private:
  /// Publishes the oldest estimate, or else the oldest detections that wait; false where there is nothing.
  bool step();
  bool publish_estimate();
  bool publish_detections();

  Inputs in_;
  std::unique_ptr<Publisher> publisher_;
  Observers observers_;
  const Clock& clock_;
  Heartbeat heartbeat_;
  LatencyHistogram latency_;
};

}  // namespace posed
