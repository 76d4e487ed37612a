#include "core/pinhole_camera.h"

#include <algorithm>
#include <limits>

#include <Eigen/LU>

namespace posed {

namespace {

struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;  // d point / d normalised
};

/// Brown-Conrady model on the normalised image plane (OpenCV's coefficient order k1, k2, p1, p2, k3), with its derivative.
Distorted distort_normalised(const CameraIntrinsics& k, const Eigen::Vector2d& n) {
  const double x = n.x();
  const double y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
  const double radial_slope = k.k1 + r2 * (2.0 * k.k2 + r2 * 3.0 * k.k3);  // d radial / d r2
  Distorted d;
  d.point.x() = x * radial + 2.0 * k.p1 * x * y + k.p2 * (r2 + 2.0 * x * x);
  d.point.y() = y * radial + k.p1 * (r2 + 2.0 * y * y) + 2.0 * k.p2 * x * y;
  d.jacobian(0, 0) = radial + 2.0 * x * x * radial_slope + 2.0 * k.p1 * y + 6.0 * k.p2 * x;
  d.jacobian(0, 1) = 2.0 * x * y * radial_slope + 2.0 * k.p1 * x + 2.0 * k.p2 * y;
  d.jacobian(1, 0) = d.jacobian(0, 1);
  d.jacobian(1, 1) = radial + 2.0 * y * y * radial_slope + 6.0 * k.p1 * y + 2.0 * k.p2 * x;
  return d;
}

}  // namespace

PinholeCamera::PinholeCamera(const CameraIntrinsics& intrinsics)
    : k_(intrinsics), distorted_(k_.k1 != 0 || k_.k2 != 0 || k_.p1 != 0 || k_.p2 != 0 || k_.k3 != 0) {}

Eigen::Vector2d PinholeCamera::distort(const Eigen::Vector2d& ideal_pixel) const {
  if (!distorted_) {
    return ideal_pixel;
  }
  const Eigen::Vector2d n((ideal_pixel.x() - k_.cx) / k_.fx, (ideal_pixel.y() - k_.cy) / k_.fy);
  const Eigen::Vector2d d = distort_normalised(k_, n).point;
  return {k_.fx * d.x() + k_.cx, k_.fy * d.y() + k_.cy};
}

Eigen::Vector2d PinholeCamera::undistort(const Eigen::Vector2d& seen_pixel) const {
  if (!distorted_) {
    return seen_pixel;
  }
  const Eigen::Vector2d target((seen_pixel.x() - k_.cx) / k_.fx, (seen_pixel.y() - k_.cy) / k_.fy);
  Eigen::Vector2d n = target;
  constexpr int kMaxIterations = 10;
  constexpr double kTolerance2 = 1e-22;  // squared, on the normalised plane: far below a millionth of a pixel
  for (int i = 0; i < kMaxIterations; ++i) {
    const Distorted d = distort_normalised(k_, n);
    const Eigen::Vector2d step = d.jacobian.inverse() * (target - d.point);
    n += step;
    if (step.squaredNorm() < kTolerance2) {
      break;
    }
  }
  return {k_.fx * n.x() + k_.cx, k_.fy * n.y() + k_.cy};
}

Eigen::Vector4d PinholeCamera::undistorted_bounds() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector4d bounds(kInfinity, kInfinity, -kInfinity, -kInfinity);
  const auto include = [&](double x, double y) {
    const Eigen::Vector2d u = undistort({x, y});
    bounds << std::min(bounds[0], u.x()), std::min(bounds[1], u.y()), std::max(bounds[2], u.x()), std::max(bounds[3], u.y());
  };
  // Barrel distortion bulges the sides, so walk the whole border, not only its corners.
  for (int x = 0; x < k_.width; ++x) {
    include(x, 0);
    include(x, k_.height - 1);
  }
  for (int y = 0; y < k_.height; ++y) {
    include(0, y);
    include(k_.width - 1, y);
  }
  return bounds;
}

}  // namespace posed
