#pragma once

#include <atomic>
#include <cstddef>
#include <stop_token>

#include "core/clock.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "daemon/health.h"
#include "daemon/slam_ports.h"
#include "daemon/stage_link.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Hands keyframes to the mapper and the map's snapshots back to the tracker. Thread-bound to the mapping thread (in lockstep, the
/// tracking thread), but for `report`, which is thread-safe.
class MappingStage {
 public:
  /// Everything passed in must outlive the stage.
  MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, const Clock& clock);

  /// Takes one keyframe in and publishes the map that follows from it; false where none waits.
  bool step();

  /// The thread's body in real time.
  void run(const std::stop_token& stop);

  void report(HealthReport& health) const;

 private:
  KeyframeMapper& mapper_;
  KeyframeLink& in_;
  LatestValue<MapSnapshot>& snapshots_;
  const Clock& clock_;

  std::atomic<std::size_t> keyframes_{0};
  std::atomic<std::size_t> landmarks_{0};
  LatencyHistogram map_time_;
};

}  // namespace posed
