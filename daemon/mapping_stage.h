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

/// Hands keyframes to the mapper and the map's snapshots back to the tracker; while no keyframe waits, lets the mapper improve the
/// map. Thread-bound to the mapping thread (in lockstep, the
/// tracking thread), but for `report`, which is thread-safe.
class MappingStage {
 public:
  /// Everything passed in must outlive the stage.
  MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, const Clock& clock);

  /// Takes one keyframe in or, where none waits, does one piece of improvement, and publishes the map that follows from it; false
  /// where there was nothing to do. `interrupt` ends an improvement early.
  bool step(const Interrupt& interrupt = {});

  /// The thread's body in real time: a keyframe that arrives interrupts an improvement.
  void run(const std::stop_token& stop);

  void report(HealthReport& health) const;

 private:
  void publish();

  KeyframeMapper& mapper_;
  KeyframeLink& in_;
  LatestValue<MapSnapshot>& snapshots_;
  const Clock& clock_;

  std::atomic<std::size_t> keyframes_{0};
  std::atomic<std::size_t> landmarks_{0};
  std::atomic<std::uint64_t> loops_closed_{0};
  std::atomic<std::uint64_t> maps_joined_{0};
  std::atomic<std::uint64_t> relocalizations_{0};
  LatencyHistogram map_time_;
};

}  // namespace posed
