#pragma once

#include <array>
#include <cstdint>

#include "core/se3.h"

namespace posed {

/// How the synthetic camera moves, as a function of time alone: a closed way, gone round again and again, which starts at rest and
/// goes at full speed from kRampUp_s on. From then on the motion repeats exactly after period_s(): every sway on it is a harmonic
/// of that period. World: z up. Camera: x right, y down, z forward. Immutable, so thread-safe.
class SyntheticTrajectory {
 public:
  static constexpr double kRampUp_s = 2.0;

  virtual ~SyntheticTrajectory() = default;

  /// T_world_camera at `t_s` >= 0 seconds.
  virtual Se3 pose(double t_s) const = 0;

  /// How long a round takes [s].
  virtual double period_s() const = 0;

 protected:
  struct Harmonic {
    double amplitude;
    int multiple;  ///< of the base frequency, one in a period
    double phase_rad;
  };
  using Harmonics = std::array<Harmonic, 3>;

  SyntheticTrajectory() = default;
  SyntheticTrajectory(const SyntheticTrajectory&) = default;
  SyntheticTrajectory& operator=(const SyntheticTrajectory&) = default;

  /// Sum of amplitude * sin(multiple * angle + phase).
  static double sum(const Harmonics& harmonics, double angle_rad);

  /// Part of the current round that is done at `t_s`, from 0 to 1.
  double progress(double t_s) const;

  /// T_world_camera of a camera that looks along `yaw_rad` (from world x towards y), upwards by `pitch_rad`.
  static Se3 camera_pose(double yaw_rad, double pitch_rad, double roll_rad, const Eigen::Vector3d& p_world);
};

/// Stays near the middle of a room while the view sweeps once around it, each coordinate a sum of harmonics (slow travel, sway, and
/// the tremor of a hand). Speeds stay below kMaxSpeed_m_s and kMaxRate_rad_s.
class SweepTrajectory final : public SyntheticTrajectory {
 public:
  static constexpr double kPeriod_s = 60.0;
  static constexpr double kMaxSpeed_m_s = 0.5;
  static constexpr double kMaxRate_rad_s = 0.7;

  explicit SweepTrajectory(std::uint32_t seed);

  Se3 pose(double t_s) const override;
  double period_s() const override { return kPeriod_s; }

  /// Bearing of the view at the start, before sway [rad, from world x towards y].
  double start_heading_rad() const { return start_heading_rad_; }

 private:
  double start_heading_rad_;
  Harmonics x_;
  Harmonics y_;
  Harmonics z_;
  Harmonics yaw_;
  Harmonics pitch_;
  Harmonics roll_;
};

}  // namespace posed
