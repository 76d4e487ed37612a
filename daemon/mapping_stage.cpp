#include "daemon/mapping_stage.h"

namespace posed {

MappingStage::MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, const Clock& clock)
    : mapper_(mapper), in_(in), snapshots_(snapshots), clock_(clock) {}

bool MappingStage::step() {
  const KeyframeRecord* const record = in_.ring.front();
  if (record == nullptr) {
    return false;
  }
  const TimeNs begin_ns = clock_.now_ns();
  mapper_.insert(*record);
  in_.ring.release();
  mapper_.write_snapshot(snapshots_.back());
  snapshots_.publish();
  map_time_.record(clock_.now_ns() - begin_ns);
  keyframes_.store(mapper_.keyframe_count(), std::memory_order_relaxed);
  landmarks_.store(mapper_.landmark_count(), std::memory_order_relaxed);
  return true;
}

void MappingStage::run(const std::stop_token& stop) {
  in_.consume(stop, [&] { return step(); });
}

void MappingStage::report(HealthReport& health) const {
  health.map_keyframes = keyframes_.load(std::memory_order_relaxed);
  health.map_landmarks = landmarks_.load(std::memory_order_relaxed);
  health.map = map_time_.summary();
}

}  // namespace posed
