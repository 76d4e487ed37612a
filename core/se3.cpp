#include "core/se3.h"

#include <cmath>

namespace posed {

namespace {

/// Left Jacobian of SO(3): V in exp((phi, rho)) = (Exp(phi), V(phi) * rho). Series below 1e-4 rad, where the closed form cancels;
/// 1 - cos(theta) is written as 2 sin^2(theta / 2), which does not cancel at all.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const double theta = std::sqrt(theta2);
  const Eigen::Matrix3d hat = skew(phi);
  const bool small = theta < 1e-4;
  const double sin_half = std::sin(0.5 * theta);
  const double b = small ? 0.5 - theta2 / 24.0 : 2.0 * sin_half * sin_half / theta2;
  const double c = small ? 1.0 / 6.0 - theta2 / 120.0 : (theta - std::sin(theta)) / (theta2 * theta);
  return Eigen::Matrix3d::Identity() + b * hat + c * hat * hat;
}

/// Written with cot(theta / 2), which stays exact up to pi, where (1 + cos(theta)) / sin(theta) becomes 0 / 0.
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const double theta = std::sqrt(theta2);
  const Eigen::Matrix3d hat = skew(phi);
  const double half = 0.5 * theta;
  const double c = theta < 1e-4 ? 1.0 / 12.0 + theta2 / 720.0 : (1.0 - half * std::cos(half) / std::sin(half)) / theta2;
  return Eigen::Matrix3d::Identity() - 0.5 * hat + c * hat * hat;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Quaterniond exp_so3(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const double theta = std::sqrt(theta2);
  const double half_sinc = theta < 1e-4 ? 0.5 - theta2 / 48.0 : std::sin(0.5 * theta) / theta;
  return Eigen::Quaterniond(std::cos(0.5 * theta), half_sinc * phi.x(), half_sinc * phi.y(), half_sinc * phi.z());
}

Eigen::Vector3d log_so3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;  // q and -q are one rotation; take the short way round
  const Eigen::Vector3d v = sign * q.vec();
  const double n = v.norm();
  if (n < 1e-9) {
    return 2.0 * v;
  }
  return (2.0 * std::atan2(n, sign * q.w()) / n) * v;
}

Se3 Se3::exp(const Vector6d& xi) {
  const Eigen::Vector3d phi = xi.head<3>();
  return Se3(exp_so3(phi), left_jacobian(phi) * xi.tail<3>());
}

Vector6d Se3::log() const {
  Vector6d xi;
  xi.head<3>() = log_so3(rotation_);
  xi.tail<3>() = inverse_left_jacobian(xi.head<3>()) * translation_;
  return xi;
}

Matrix6d Se3::adjoint() const {
  const Eigen::Matrix3d r = rotation_matrix();
  Matrix6d ad;
  ad << r, Eigen::Matrix3d::Zero(), skew(translation_) * r, r;
  return ad;
}

}  // namespace posed
