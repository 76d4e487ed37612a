#pragma once

#include "core/se3.h"

/// What the pose of a camera knows of the map's origin. All covariances are of xi = (phi, rho) in T_map_camera * exp(xi) [rad, m],
/// as in PoseEstimate. Why this model, how its figures were found and how far they hold: docs/decisions/0009-covariance.md.
/// Reentrant.
namespace posed {

/// How fast the map drifts: standard deviation of each axis after one metre. The variance grows with the distance, as that of a
/// random walk. Calibrated on the runs of `consistency_bench 1 4`, checked by `consistency_bench 5 8`.
struct DriftRates {
  double sigma_rad = 1.2e-3;
  double sigma_m = 4.4e-3;
};

/// The same variance for each axis of rotation, and for each of translation.
inline Matrix6d isotropic_covariance(double rotation_variance, double translation_variance) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_variance), Eigen::Vector3d::Constant(translation_variance);
  return variances.asDiagonal();
}

/// Of the frame that a map begins with. It defines the map's frame, but only as well as it measured its landmarks: a pose solved
/// from a single frame's landmarks, at the same place, scatters by about this much. It also keeps every covariance invertible.
inline Matrix6d start_covariance() {
  constexpr double kSigma_rad = 0.5e-3;
  constexpr double kSigma_m = 1e-3;
  return isotropic_covariance(kSigma_rad * kSigma_rad, kSigma_m * kSigma_m);
}

/// Of a pose: its error given the landmarks it was solved from; the error of its anchor, a keyframe that sees the same landmarks;
/// and what the landmarks have drifted from there to here.
inline Matrix6d drifted_covariance(const Matrix6d& given_map, const Se3& T_anchor_camera, const Matrix6d& anchor_covariance,
                                   const DriftRates& rates = {}) {
  const Matrix6d to_camera = T_anchor_camera.inverse().adjoint();
  const double distance_m = T_anchor_camera.translation().norm();
  const Matrix6d inherited = to_camera * anchor_covariance * to_camera.transpose();
  return given_map + 0.5 * (inherited + inherited.transpose()) +
         isotropic_covariance(rates.sigma_rad * rates.sigma_rad * distance_m, rates.sigma_m * rates.sigma_m * distance_m);
}

}  // namespace posed
