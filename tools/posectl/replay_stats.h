#pragma once

#include <cstdint>
#include <string>

#include "core/metrics.h"
#include "daemon/health.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// What a replay has to tell about itself. Plain data.
struct ReplayStats {
  SourceInfo source;
  bool lockstep = false;
  bool interrupted = false;  ///< by a signal, before the source had ended
  double wall_s = 0;
  double residual_variance = 0;  ///< EstimateRecorder::residual_variance
  HealthReport health;
};

/// Frames that the source counted: processed, dropped on the way, missed, or lost because the pool was full. Reentrant.
std::uint64_t frames_delivered(const HealthReport& health);

/// Frames that the tracker never saw: pushed out of its queue, missed by the source, or lost because the pool was full. Reentrant.
std::uint64_t frames_dropped(const HealthReport& health);

/// One JSON object; docs/posectl.md describes its keys. Reentrant.
std::string to_json(const ReplayStats& stats);

/// The same in a few lines for people. Reentrant.
std::string format_replay_summary(const ReplayStats& stats);

}  // namespace posed
