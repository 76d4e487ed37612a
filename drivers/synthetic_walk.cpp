#include "drivers/synthetic_walk.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/synthetic_hash.h"

namespace posed {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kHeight_m = 1.35;
constexpr double kPitch_rad = -0.08;  ///< slightly down, as one who walks

}  // namespace

WalkTrajectory::WalkTrajectory(RoundedPath path, std::uint32_t seed) : path_(std::move(path)) {
  HashRng rng(hash32(seed, 0x3a1c0U));
  const auto phase = [&rng] { return kTurn * static_cast<double>(rng.uniform()); };
  // A round takes some 40 s: the multiples 4 to 16 are slow sway, those above 40 the steps.
  side_ = {{{0.045, 4, phase()}, {0.025, 14, phase()}, {0.008, 42, phase()}}};
  z_ = {{{0.03, 6, phase()}, {0.015, 16, phase()}, {0.008, 84, phase()}}};
  yaw_ = {{{0.05, 6, phase()}, {0.035, 16, phase()}, {0.006, 42, phase()}}};
  pitch_ = {{{0.04, 8, phase()}, {0.015, 22, phase()}, {0.004, 84, phase()}}};
  roll_ = {{{0.02, 10, phase()}, {0.008, 42, phase()}, {0.002, 66, phase()}}};
}

Se3 WalkTrajectory::pose(double t_s) const {
  const double done = progress(t_s);
  const double angle = kTurn * done;
  const double s_m = done * path_.length_m();
  const double heading = path_.mean_heading_rad(s_m, kLookAhead_m);
  const Eigen::Vector2d left(-std::sin(heading), std::cos(heading));
  const Eigen::Vector2d position = path_.point(s_m) + sum(side_, angle) * left;
  return camera_pose(heading + sum(yaw_, angle), kPitch_rad + sum(pitch_, angle), sum(roll_, angle),
                     {position.x(), position.y(), kHeight_m + sum(z_, angle)});
}

}  // namespace posed
