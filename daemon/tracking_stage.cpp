#include "daemon/tracking_stage.h"

#include <optional>
#include <utility>

#include "core/memory_lock.h"

namespace posed {

TrackingStage::TrackingStage(FrameTracker& tracker, Links links, const Clock& clock, FullQueue full_queue,
                             std::function<void(const TrackedView&)> on_tracked)
    : tracker_(tracker), links_(links), clock_(clock), full_queue_(full_queue), on_tracked_(std::move(on_tracked)) {}

void TrackingStage::track(const RgbdFrame& frame, const std::stop_token& stop) {
  const HeartbeatScope working(heartbeat_, clock_);
  links_.snapshots.refresh();
  links_.detections.refresh();
  KeyframeRecord* const candidate = links_.keyframes.ring.claim();
  if (candidate == nullptr) {
    keyframes_delayed_.add();
  }

  const TimeNs begin_ns = clock_.now_ns();
  PoseEstimate estimate = tracker_.track(frame, links_.snapshots.front(), &links_.detections.front(), candidate);
  estimate.track_ns = clock_.now_ns() - begin_ns;

  track_time_.record(estimate.track_ns);
  state_.store(estimate.state, std::memory_order_relaxed);
  masked_share_.store(estimate.masked_share, std::memory_order_relaxed);
  people_.store(estimate.people, std::memory_order_relaxed);
  other_movers_.store(estimate.other_movers, std::memory_order_relaxed);
  detection_age_ns_.store(estimate.detection_age_ns, std::memory_order_relaxed);
  (estimate.has_pose() ? tracked_ : lost_).add();
  if ((estimate.keyframe || estimate.asks_where) && candidate != nullptr) {
    keyframes_.add(estimate.keyframe ? 1 : 0);
    links_.keyframes.ring.commit();
    links_.keyframes.notify_arrived();
  }
  if (on_tracked_) {
    on_tracked_({frame, estimate, tracker_.last_mask(), tracker_.last_features()});
  }
  hand_on(estimate, stop);
  page_faults_.set(static_cast<std::int64_t>(thread_page_faults()));
}

void TrackingStage::hand_on(const PoseEstimate& estimate, const std::stop_token& stop) {
  if (full_queue_ == FullQueue::Waits && !links_.estimates.wait_for_room(stop)) {
    return;
  }
  if (const std::optional<PoseEstimate> oldest = links_.estimates.ring.push(estimate)) {
    poses_dropped_.add();
  }
  links_.estimates.notify_arrived();
}

void TrackingStage::run(const std::stop_token& stop, FrameLink& in) {
  in.consume(stop, [&] {
    const std::optional<FrameRef> frame = in.ring.pop();
    if (frame) {
      track(**frame, stop);
    }
    return frame.has_value();
  });
  close_outputs();
}

void TrackingStage::close_outputs() {
  links_.keyframes.close();
  links_.estimates.close();
}

void TrackingStage::report(HealthReport& health) const {
  health.state = state_.load(std::memory_order_relaxed);
  health.masked_share = masked_share_.load(std::memory_order_relaxed);
  health.people = people_.load(std::memory_order_relaxed);
  health.other_movers = other_movers_.load(std::memory_order_relaxed);
  health.detection_age_ns = detection_age_ns_.load(std::memory_order_relaxed);
  health.frames_tracked = tracked_.value();
  health.frames_lost = lost_.value();
  health.keyframes = keyframes_.value();
  health.keyframes_delayed = keyframes_delayed_.value();
  health.poses_dropped = poses_dropped_.value();
  health.tracker_page_faults = static_cast<std::uint64_t>(page_faults_.value());
  health.track = track_time_.summary();
}

}  // namespace posed
