#pragma once

#include <posed/pose_t.hpp>
#include <posed/status_t.hpp>

#include "core/clock.h"
#include "daemon/health.h"
#include "tools/posectl/watch_statistics.h"

/// From the daemon's messages back to plain values: the inverse of daemon/message_conversion.h. Reentrant.
namespace posed {

PoseSample from_pose_message(const pose_t& message, TimeNs receive_ns);

HealthReport from_status_message(const status_t& message);

}  // namespace posed
