#include "daemon/mapping_stage.h"

namespace posed {

MappingStage::MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, MapSaver& saver,
                           const Clock& clock)
    : mapper_(mapper), in_(in), snapshots_(snapshots), saver_(saver), clock_(clock) {}

void MappingStage::publish_map() {
  mapper_.write_snapshot(snapshots_.back());
  snapshots_.publish();
  keyframes_.store(mapper_.keyframe_count(), std::memory_order_relaxed);
  landmarks_.store(mapper_.landmark_count(), std::memory_order_relaxed);
  const MapperCounters counters = mapper_.counters();
  loops_closed_.store(counters.loops_closed, std::memory_order_relaxed);
  maps_joined_.store(counters.maps_joined, std::memory_order_relaxed);
  relocalizations_.store(counters.relocalizations_found, std::memory_order_relaxed);
}

bool MappingStage::step(const Interrupt& interrupt) {
  const HeartbeatScope working(heartbeat_, clock_);
  saver_.save_if_due();
  const KeyframeRecord* const record = in_.ring.front();
  if (record == nullptr) {
    if (!mapper_.improve(interrupt)) {
      return false;
    }
    publish_map();
    return true;
  }
  const TimeNs begin_ns = clock_.now_ns();
  mapper_.insert(*record);
  in_.ring.release();
  saver_.note_keyframe();
  publish_map();
  map_time_.record(clock_.now_ns() - begin_ns);
  return true;
}

void MappingStage::run(const std::stop_token& stop, const std::function<void()>& on_drained) {
  const Interrupt interrupt = [&] { return stop.stop_requested() || in_.ring.front() != nullptr; };
  in_.consume(stop, [&] { return step(interrupt); });
  finish(stop, on_drained);
}

void MappingStage::finish(const std::stop_token& stop, const std::function<void()>& on_drained) {
  {
    const HeartbeatScope working(heartbeat_, clock_);
    saver_.save_at_end();
  }
  on_drained();
  while (!stop.stop_requested()) {
    const std::uint32_t seen = in_.generation();
    saver_.save_if_due();
    in_.wait_arrived(seen, kNsPerSecond);
  }
}

void MappingStage::report(HealthReport& health) const {
  health.map_keyframes = keyframes_.load(std::memory_order_relaxed);
  health.map_landmarks = landmarks_.load(std::memory_order_relaxed);
  health.loops_closed = loops_closed_.load(std::memory_order_relaxed);
  health.maps_joined = maps_joined_.load(std::memory_order_relaxed);
  health.relocalizations = relocalizations_.load(std::memory_order_relaxed);
  health.map = map_time_.summary();
  saver_.report(health);
}

}  // namespace posed
