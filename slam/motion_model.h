#pragma once

#include <cstdint>
#include <optional>

#include "core/clock.h"
#include "core/se3.h"

namespace posed {

/// Predicts the camera's pose on the assumption that it goes on moving as between the last two frames (constant velocity, scaled by
/// the time that passed, so that a dropped frame does no harm). Reentrant.
class MotionModel {
 public:
  /// Forgets the motion: after a jump, what was before says nothing of what comes.
  void restart() { *this = MotionModel(); }

  /// Nothing before the first observation and after a restart.
  std::optional<Se3> last_pose() const { return has_pose_ ? std::optional(T_odom_camera_) : std::nullopt; }

  void observe(const Se3& T_odom_camera, std::int64_t stamp_ns) {
    if (has_pose_ && stamp_ns > stamp_ns_) {
      velocity_ = (T_odom_camera_.inverse() * T_odom_camera).log() / to_seconds(stamp_ns - stamp_ns_);
    }
    T_odom_camera_ = T_odom_camera;
    stamp_ns_ = stamp_ns;
    has_pose_ = true;
  }

  /// How the camera moves in `duration_ns`, which may be negative: its pose then, in its frame now.
  Se3 motion_over(TimeNs duration_ns) const { return Se3::exp(velocity_ * to_seconds(duration_ns)); }

  /// The last pose, moved on to `stamp_ns`; not at all where the last pose is too old for its velocity to hold.
  Se3 predict(std::int64_t stamp_ns) const {
    const std::int64_t elapsed_ns = stamp_ns - stamp_ns_;
    if (elapsed_ns <= 0 || elapsed_ns > kMaxElapsedNs) {
      return T_odom_camera_;
    }
    return T_odom_camera_ * Se3::exp(velocity_ * to_seconds(elapsed_ns));
  }

 private:
  static constexpr std::int64_t kMaxElapsedNs = kNsPerSecond / 2;

  Se3 T_odom_camera_;
  Vector6d velocity_ = Vector6d::Zero();  // [rad/s, m/s] in the camera frame
  std::int64_t stamp_ns_ = 0;
  bool has_pose_ = false;
};

}  // namespace posed
