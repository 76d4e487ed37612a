#pragma once

#include "core/se3.h"

namespace posed {

/// What poses know of the map's origin. All covariances are of xi = (phi, rho) in T_map_camera * exp(xi) [rad, m], as in
/// PoseEstimate. The model and how its figures were found: docs/decisions/0009-covariance.md. Reentrant.
namespace drift_model {

/// Of the frame that a map begins with. It defines the map's frame, so its own error is nothing; but whoever comes back to its
/// place is tracked against landmarks that it measured once, and a pose solved from as many such measurements scatters by this
/// much. It also keeps the covariance regular, as filters need it.
constexpr double kStartSigma_rad = 0.5e-3;
constexpr double kStartSigma_m = 1e-3;

/// Drift is a random walk: its variance grows with the distance between two keyframes that see the same landmarks. Standard
/// deviations after one metre, each axis. Calibrated on synthetic worlds by `consistency_bench calibrate`.
constexpr double kDriftSigma_rad = 1.2e-3;
constexpr double kDriftSigma_m = 4.4e-3;

inline Matrix6d diagonal(double rotation_variance, double translation_variance) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_variance), Eigen::Vector3d::Constant(translation_variance);
  return variances.asDiagonal();
}

inline Matrix6d start_covariance() {
  return diagonal(kStartSigma_rad * kStartSigma_rad, kStartSigma_m * kStartSigma_m);
}

/// Of a pose: its error given the landmarks it was solved from, the error of the anchor, a keyframe that sees the same landmarks,
/// and what the landmarks have drifted between the two.
inline Matrix6d pose_covariance(const Matrix6d& given_map, const Se3& T_anchor_camera, const Matrix6d& anchor_covariance) {
  const Matrix6d to_camera = T_anchor_camera.inverse().adjoint();
  const double distance_m = T_anchor_camera.translation().norm();
  const Matrix6d sum = given_map + to_camera * anchor_covariance * to_camera.transpose() +
                       diagonal(kDriftSigma_rad * kDriftSigma_rad * distance_m, kDriftSigma_m * kDriftSigma_m * distance_m);
  return 0.5 * (sum + sum.transpose());
}

}  // namespace drift_model

}  // namespace posed
