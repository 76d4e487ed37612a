#include "drivers/synthetic_trajectory.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/synthetic_hash.h"

namespace posed {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kHeight_m = 1.35;
constexpr double kPitch_rad = -0.12;  ///< slightly down: furniture rather than ceiling

/// Time that starts slowly: its rate rises smoothly (3 s^2 - 2 s^3) from 0 to 1 within the ramp; afterwards it runs at 1.
double ramped(double t_s) {
  const double s = std::clamp(t_s / SyntheticTrajectory::kRampUp_s, 0.0, 1.0);
  const double integral = s * s * s - 0.5 * s * s * s * s;  // of the rate, from 0 to s; 1/2 at s = 1
  return integral * SyntheticTrajectory::kRampUp_s + std::max(t_s - SyntheticTrajectory::kRampUp_s, 0.0);
}

}  // namespace

double SyntheticTrajectory::sum(const Harmonics& harmonics, double angle_rad) {
  double value = 0;
  for (const Harmonic& h : harmonics) {
    value += h.amplitude * std::sin(h.multiple * angle_rad + h.phase_rad);
  }
  return value;
}

double SyntheticTrajectory::progress(double t_s) const {
  return std::fmod(ramped(t_s) / period_s(), 1.0);
}

Se3 SyntheticTrajectory::camera_pose(double yaw_rad, double pitch_rad, double roll_rad, const Eigen::Vector3d& p_world) {
  // Body axes (x forward, y left, z up) to the optical ones (z forward, x right, y down).
  const Eigen::Quaterniond R_body_camera(Eigen::Matrix3d{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}});
  const Eigen::Quaterniond R_world_body = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(-pitch_rad, Eigen::Vector3d::UnitY()) *
                                          Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
  return Se3(R_world_body * R_body_camera, p_world);
}

SweepTrajectory::SweepTrajectory(std::uint32_t seed) {
  HashRng rng(hash32(seed, 0xca3e7aU));
  const auto phase = [&rng] { return kTurn * static_cast<double>(rng.uniform()); };
  start_heading_rad_ = phase();
  x_ = {{{0.42, 3, phase()}, {0.13, 8, phase()}, {0.015, 25, phase()}}};
  y_ = {{{0.28, 2, phase()}, {0.09, 7, phase()}, {0.015, 23, phase()}}};
  z_ = {{{0.12, 5, phase()}, {0.03, 11, phase()}, {0.008, 31, phase()}}};
  yaw_ = {{{0.35, 4, phase()}, {0.12, 9, phase()}, {0.012, 27, phase()}}};
  pitch_ = {{{0.10, 5, phase()}, {0.04, 13, phase()}, {0.008, 29, phase()}}};
  roll_ = {{{0.035, 6, phase()}, {0.015, 19, phase()}, {0.004, 33, phase()}}};
}

Se3 SweepTrajectory::pose(double t_s) const {
  const double angle = kTurn * progress(t_s);
  const double yaw = start_heading_rad_ + angle + sum(yaw_, angle);
  const double pitch = kPitch_rad + sum(pitch_, angle);
  return camera_pose(yaw, pitch, sum(roll_, angle), {sum(x_, angle), sum(y_, angle), kHeight_m + sum(z_, angle)});
}

}  // namespace posed
