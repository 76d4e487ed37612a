#pragma once

#include <cstdint>
#include <string_view>

#include "core/clock.h"
#include "core/se3.h"

namespace posed {

enum class TrackingState : std::uint8_t { Initializing, Tracking, Lost, Relocalizing };

constexpr std::string_view to_string(TrackingState state) {
  switch (state) {
    case TrackingState::Initializing: return "initializing";
    case TrackingState::Tracking: return "tracking";
    case TrackingState::Lost: return "lost";
    case TrackingState::Relocalizing: return "relocalizing";
  }
  return "unknown";
}

/// What the tracker says of one frame. Plain data, so it crosses threads by value.
struct PoseEstimate {
  std::uint64_t sequence = 0;
  TimeNs capture_ns = 0;
  std::int64_t stamp_utc_ns = 0;
  TrackingState state = TrackingState::Initializing;

  /// Valid only where `state == Tracking`; identity otherwise, and never published then.
  Se3 T_odom_camera;
  Se3 T_map_odom;  ///< identity at the start; every correction of the map is in it
  /// Covariance of xi = (phi, rho) [rad, m] where the true pose is T_map_camera * exp(xi): rotation first, in the camera frame.
  Matrix6d covariance = Matrix6d::Zero();

  std::int32_t keypoints = 0;    ///< extracted in this frame
  std::int32_t matches = 0;      ///< landmarks matched before outliers were rejected
  std::int32_t inliers = 0;      ///< landmarks the pose rests on
  double residual_variance = 1;  ///< of the inliers, over what the noise model says: larger where the calibration is off
  std::uint32_t map_id = 0;
  std::uint64_t map_version = 0;  ///< of the snapshot that was used
  bool keyframe = false;          ///< the frame was handed to the mapper as a keyframe
  bool asks_where = false;        ///< the frame was handed to the mapper to be relocalised
  TimeNs detection_age_ns = -1;   ///< age of the person detections used; -1 where none were
  float masked_share = 0;         ///< of the image that shows movers, 0 to 1: the pose does not rest on it
  std::int32_t people = 0;        ///< movers that a detection explains
  std::int32_t other_movers = 0;  ///< movers that only their motion gives away

  /// The keyframe this pose hangs on, and the pose relative to it: what a final trajectory is rebuilt from after the map has moved.
  std::uint64_t reference_keyframe = 0;
  Se3 T_reference_camera;

  TimeNs track_ns = 0;  ///< time spent in the tracker

  bool has_pose() const { return state == TrackingState::Tracking; }
  Se3 T_map_camera() const { return T_map_odom * T_odom_camera; }
};

}  // namespace posed
