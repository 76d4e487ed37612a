#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <bot_core/pose_t.hpp>
#include <posed/detections_t.hpp>
#include <posed/pose_t.hpp>
#include <posed/status_t.hpp>

#include "core/clock.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/se3.h"
#include "daemon/health.h"

/// From the pipeline's values to the messages of messages/*.lcm, whose comments are the reference. All reentrant.
namespace posed {

/// An estimate without a pose becomes a message whose transforms and covariance are NaN.
pose_t to_pose_message(const PoseEstimate& estimate, const Se3& T_base_camera, TimeNs publish_ns);

/// T_map_base; nothing where the estimate has no pose, for this type cannot say so.
std::optional<bot_core::pose_t> to_bot_core_pose(const PoseEstimate& estimate, const Se3& T_base_camera);

detections_t to_detections_message(const Detections& detections, TimeNs publish_ns);

/// Where and when a report was made.
struct StatusOrigin {
  TimeNs mono_ns = 0;
  std::int64_t utc_ns = 0;
  std::string_view version;
  std::string_view transport;
};
status_t to_status_message(const HealthReport& health, const StatusOrigin& origin);

}  // namespace posed
