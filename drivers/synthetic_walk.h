#pragma once

#include <cstdint>

#include "drivers/synthetic_path.h"
#include "drivers/synthetic_trajectory.h"

namespace posed {

/// Walks along a path at kSpeed_m_s and looks where it goes: towards the mean direction of the next kLookAhead_m, so that corners
/// are looked into before they are reached and the view turns smoothly. The head sways sideways, up and down, and in its three
/// angles. Every sway is an even harmonic of the round, so that it repeats after half a round, too: where the second half of a path
/// looks like its first, so does the motion. The turning rate stays below kMaxRate_rad_s in corners of 90 degrees.
class WalkTrajectory final : public SyntheticTrajectory {
 public:
  static constexpr double kSpeed_m_s = 2.0 / 3.0;
  static constexpr double kLookAhead_m = 1.4;
  static constexpr double kMaxSpeed_m_s = 0.85;  ///< sway included
  static constexpr double kMaxRate_rad_s = 1.0;  ///< 57 degrees a second

  WalkTrajectory(RoundedPath path, std::uint32_t seed);

  Se3 pose(double t_s) const override;
  double period_s() const override { return path_.length_m() / kSpeed_m_s; }

  const RoundedPath& path() const { return path_; }

 private:
  RoundedPath path_;
  Harmonics side_;
  Harmonics z_;
  Harmonics yaw_;
  Harmonics pitch_;
  Harmonics roll_;
};

}  // namespace posed
