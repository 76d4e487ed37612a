#pragma once

#include <array>
#include <cstdint>

#include "core/se3.h"

namespace posed {

/// How the synthetic camera moves, as a function of time alone: a closed path of kPeriod_s that stays near the middle of the room
/// while the view sweeps once around it, each coordinate a sum of harmonics of that period (slow travel, sway, and the tremor of a
/// hand). It starts at rest; full speed is reached after kRampUp_s. Speeds stay below kMaxSpeed_m_s and kMaxRate_rad_s. Immutable,
/// so thread-safe.
class SyntheticTrajectory {
 public:
  static constexpr double kPeriod_s = 60.0;
  static constexpr double kRampUp_s = 2.0;
  static constexpr double kMaxSpeed_m_s = 0.5;
  static constexpr double kMaxRate_rad_s = 0.7;

  explicit SyntheticTrajectory(std::uint32_t seed);

  /// T_world_camera at `t_s` >= 0 seconds. World: z up, the floor's middle at the origin. Camera: x right, y down, z forward.
  Se3 pose(double t_s) const;

  /// Bearing of the view at the start, before sway [rad, from world x towards y].
  double start_heading_rad() const { return start_heading_rad_; }

  /// Bearing of the sweep at `t_s`, before sway.
  double sweep_heading_rad(double t_s) const;

 private:
  struct Harmonic {
    double amplitude;
    int multiple;  ///< of the base frequency 1 / kPeriod_s
    double phase_rad;
  };
  using Harmonics = std::array<Harmonic, 3>;

  static double sum(const Harmonics& harmonics, double angle_rad);

  double start_heading_rad_;
  Harmonics x_;
  Harmonics y_;
  Harmonics z_;
  Harmonics yaw_;
  Harmonics pitch_;
  Harmonics roll_;
};

}  // namespace posed
