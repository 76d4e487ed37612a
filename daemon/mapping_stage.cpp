#include "daemon/mapping_stage.h"

namespace posed {

MappingStage::MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, const Clock& clock)
    : mapper_(mapper), in_(in), snapshots_(snapshots), clock_(clock) {}

bool MappingStage::step(const Interrupt& interrupt) {
  const KeyframeRecord* const record = in_.ring.front();
  if (record == nullptr) {
    if (!mapper_.improve(interrupt)) {
      return false;
    }
    publish();
    return true;
  }
  const TimeNs begin_ns = clock_.now_ns();
  mapper_.insert(*record);
  in_.ring.release();
  publish();
  map_time_.record(clock_.now_ns() - begin_ns);
  return true;
}

void MappingStage::publish() {
  mapper_.write_snapshot(snapshots_.back());
  snapshots_.publish();
  keyframes_.store(mapper_.keyframe_count(), std::memory_order_relaxed);
  landmarks_.store(mapper_.landmark_count(), std::memory_order_relaxed);
  const MapperCounters counters = mapper_.counters();
  loops_closed_.store(counters.loops_closed, std::memory_order_relaxed);
  maps_joined_.store(counters.maps_joined, std::memory_order_relaxed);
  relocalizations_.store(counters.relocalizations_found, std::memory_order_relaxed);
}

void MappingStage::run(const std::stop_token& stop) {
  const Interrupt interrupt = [&] { return stop.stop_requested() || in_.ring.front() != nullptr; };
  in_.consume(stop, [&] { return step(interrupt); });
}

void MappingStage::report(HealthReport& health) const {
  health.map_keyframes = keyframes_.load(std::memory_order_relaxed);
  health.map_landmarks = landmarks_.load(std::memory_order_relaxed);
  health.loops_closed = loops_closed_.load(std::memory_order_relaxed);
  health.maps_joined = maps_joined_.load(std::memory_order_relaxed);
  health.relocalizations = relocalizations_.load(std::memory_order_relaxed);
  health.map = map_time_.summary();
}

}  // namespace posed
