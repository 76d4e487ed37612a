#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace posed {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rotation vector to unit quaternion (Rodrigues), exact to rounding near zero too. Reentrant.
Eigen::Quaterniond exp_so3(const Eigen::Vector3d& phi);

/// Unit quaternion to rotation vector, |phi| <= pi. Reentrant.
Eigen::Vector3d log_so3(const Eigen::Quaterniond& q);

/// The matrix that makes skew(a) * b == a.cross(b).
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// A rigid transform. `T_a_b` maps coordinates in b to coordinates in a: p_a = T_a_b * p_b, and neighbouring names cancel:
/// T_a_c = T_a_b * T_b_c. Metres. The tangent is xi = (phi, rho), rotation [rad] first, and perturbations are applied on the
/// right: T * exp(xi), so they live in the frame that T maps from. Source: Sola, Deray, Atchuthan, "A micro Lie theory for
/// state estimation in robotics", 2018, section D and appendix D. Reentrant.
class Se3 {
 public:
  Se3() = default;
  Se3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}

  /// From a quaternion of unit length to rounding, which is kept bit by bit: for transforms that were saved.
  static Se3 from_unit(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    Se3 T;
    T.rotation_ = rotation;
    T.translation_ = translation;
    return T;
  }

  static Se3 exp(const Vector6d& xi);
  Vector6d log() const;

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotation_matrix() const { return rotation_.toRotationMatrix(); }

  Se3 inverse() const {
    const Eigen::Quaterniond r = rotation_.conjugate();
    return Se3(r, r * -translation_);
  }
  Se3 operator*(const Se3& other) const { return Se3(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation_ * p + translation_; }

  /// Ad such that T * exp(xi) == exp(Ad * xi) * T: it moves a tangent (and Ad * C * Ad^T a covariance) to the left side.
  Matrix6d adjoint() const;

  bool is_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace posed
