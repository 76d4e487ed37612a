#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "core/clock.h"
#include "core/estimates.h"
#include "core/metrics.h"
#include "daemon/health.h"
#include "daemon/publisher.h"
#include "daemon/stage_link.h"

namespace posed {

/// The end of the pipeline: publishes estimates in their order and shows them to whoever asked. liblcm takes locks and may block,
/// which is why this has a thread to itself. Thread-bound to the publisher thread, but for `report`, which is thread-safe.
class PublishStage {
 public:
  /// `publisher` may be null (nothing is sent) and `on_estimate` empty. `in` and `clock` must outlive the stage.
  PublishStage(EstimateLink& in, std::unique_ptr<Publisher> publisher, std::function<void(const PoseEstimate&)> on_estimate,
               const Clock& clock);

  /// The thread's body. Calls `on_drained` once, when the estimates have ended and all are published; status goes on until `stop`.
  void run(const std::stop_token& stop, const std::function<void()>& on_drained);

  void report(HealthReport& health) const;

 private:
  /// Publishes the oldest estimate that waits; false where there is none.
  bool step();

  EstimateLink& in_;
  std::unique_ptr<Publisher> publisher_;
  std::function<void(const PoseEstimate&)> on_estimate_;
  const Clock& clock_;
  LatencyHistogram latency_;
};

}  // namespace posed
