#pragma once

#include <Eigen/Core>
#include <ceres/manifold.h>

#include "core/se3.h"

namespace posed {

/// A pose as Ceres holds it: the quaternion's x, y, z, w, then the translation. A cost function gives its derivatives by the
/// tangent xi of T * exp(xi) as the first six columns of a Jacobian and zeros as the seventh; `PlusJacobian` picks those six.
class Se3Manifold final : public ceres::Manifold {
 public:
  static constexpr int kAmbientSize = 7;
  using Coordinates = Eigen::Matrix<double, kAmbientSize, 1>;

  static Coordinates to_coordinates(const Se3& T) {
    Coordinates x;
    x << T.rotation().coeffs(), T.translation();
    return x;
  }
  static Se3 from_coordinates(const double* x) {
    return Se3(Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Map<const Eigen::Vector3d>(x + 4));
  }

  int AmbientSize() const override { return kAmbientSize; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Se3 sum = from_coordinates(x) * Se3::exp(Eigen::Map<const Vector6d>(delta));
    Eigen::Map<Coordinates>(x_plus_delta, kAmbientSize) = to_coordinates(sum);
    return true;
  }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbientSize, 6, Eigen::RowMajor>>(jacobian, kAmbientSize, 6).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>(y_minus_x, 6) = (from_coordinates(x).inverse() * from_coordinates(y)).log();
    return true;
  }
  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kAmbientSize, Eigen::RowMajor>>(jacobian, 6, kAmbientSize).setIdentity();
    return true;
  }
};

}  // namespace posed
