#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <stop_token>

#include "core/clock.h"
#include "core/heartbeat.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "daemon/health.h"
#include "daemon/map_saver.h"
#include "daemon/slam_ports.h"
#include "daemon/stage_link.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Hands keyframes to the mapper and the map's snapshots back to the tracker; while no keyframe waits, lets the mapper improve the
/// map; has the map saved in between. Thread-bound to the mapping thread (in lockstep, the tracking thread), but for `report`,
/// which is thread-safe.
class MappingStage {
 public:
  /// Everything passed in must outlive the stage.
  MappingStage(KeyframeMapper& mapper, KeyframeLink& in, LatestValue<MapSnapshot>& snapshots, MapSaver& saver, const Clock& clock);

  /// Publishes the map as it is: one that was loaded, before anything runs.
  void publish_map();

  /// Saves the map where that is due. Then takes one keyframe in or, where none waits, does one piece of improvement, and publishes
  /// the map that follows from it; false where there was nothing to do. `interrupt` ends an improvement early.
  bool step(const Interrupt& interrupt = {});

  /// The thread's body in real time: a keyframe that arrives interrupts an improvement. Calls `on_drained` as `finish` does.
  void run(const std::stop_token& stop, const std::function<void()>& on_drained);

  /// After the last keyframe: saves the map, calls `on_drained`, and goes on to save it on request until `stop`.
  void finish(const std::stop_token& stop, const std::function<void()>& on_drained);

  void report(HealthReport& health) const;
  const Heartbeat& heartbeat() const { return heartbeat_; }

 private:
  KeyframeMapper& mapper_;
  KeyframeLink& in_;
  LatestValue<MapSnapshot>& snapshots_;
  MapSaver& saver_;
  const Clock& clock_;

  std::atomic<std::size_t> keyframes_{0};
  std::atomic<std::size_t> landmarks_{0};
  std::atomic<std::uint64_t> loops_closed_{0};
  std::atomic<std::uint64_t> maps_joined_{0};
  std::atomic<std::uint64_t> relocalizations_{0};
  Heartbeat heartbeat_;
  LatencyHistogram map_time_;
};

}  // namespace posed
