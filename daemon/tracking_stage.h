#pragma once

#include <atomic>
#include <functional>
#include <stop_token>

#include "core/clock.h"
#include "core/detections.h"
#include "core/heartbeat.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "daemon/health.h"
#include "daemon/slam_ports.h"
#include "daemon/stage_link.h"
#include "daemon/tracked_view.h"
#include "slam/map_snapshot.h"

namespace posed {

/// What happens to an estimate where the queue before the publisher is full.
enum class FullQueue {
  DropsOldest,  ///< real time: the newest pose matters, the loss is counted
  Waits,        ///< lockstep: nothing is lost
};

/// Tracks frames against the newest map snapshot and hands poses to the publisher and keyframes to the mapper. Thread-bound to the
/// tracking thread, but for `report`, which is thread-safe. Takes no lock, does not allocate and, with `FullQueue::DropsOldest`,
/// does not wait for another stage.
class TrackingStage {
 public:
  struct Links {
    LatestValue<MapSnapshot>& snapshots;  ///< read here, written by the mapper
    LatestValue<Detections>& detections;  ///< read here, written by the detector
    KeyframeLink& keyframes;
    EstimateLink& estimates;
  };

  /// Everything passed in must outlive the stage. `on_tracked`: called after each frame, for tools; it takes the thread's time.
  TrackingStage(FrameTracker& tracker, Links links, const Clock& clock, FullQueue full_queue,
                std::function<void(const TrackedView&)> on_tracked = {});

  void track(const RgbdFrame& frame, const std::stop_token& stop);

  /// The thread's body in real time: every frame of `in`; closes both outputs when `in` has ended.
  void run(const std::stop_token& stop, FrameLink& in);

  /// Tells mapper and publisher that nothing follows.
  void close_outputs();

  void report(HealthReport& health) const;
  const Heartbeat& heartbeat() const { return heartbeat_; }

 private:
  void hand_on(const PoseEstimate& estimate, const std::stop_token& stop);

  FrameTracker& tracker_;
  Links links_;
  const Clock& clock_;
  FullQueue full_queue_;
  std::function<void(const TrackedView&)> on_tracked_;

  std::atomic<TrackingState> state_{TrackingState::Initializing};
  std::atomic<float> masked_share_{0};
  std::atomic<std::int32_t> people_{0};
  std::atomic<std::int32_t> other_movers_{0};
  std::atomic<TimeNs> detection_age_ns_{-1};
  Counter tracked_;
  Counter lost_;
  Counter keyframes_;
  Counter keyframes_delayed_;
  Counter poses_dropped_;
  Gauge page_faults_;
  Heartbeat heartbeat_;
  LatencyHistogram track_time_;
};

}  // namespace posed
