#pragma once

#include "core/se3.h"

/// What the pose of a camera knows of the map's origin. All covariances are of xi = (phi, rho) in T_map_camera * exp(xi) [rad, m],
/// as in PoseEstimate. Why this model, how its figures were found and how far they hold: docs/decisions/0009-covariance.md.
/// Reentrant.
namespace posed {

/// The same variance for each axis of rotation, and for each of translation.
inline Matrix6d isotropic_covariance(double rotation_variance, double translation_variance) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_variance), Eigen::Vector3d::Constant(translation_variance);
  return variances.asDiagonal();
}

/// Of the frame that a map begins with. It defines the map's frame, but only as well as it measured its landmarks: a pose solved
/// from a single frame's landmarks, at the same place, scatters by about this much. It also keeps every covariance invertible.
inline Matrix6d start_covariance() {
  constexpr double kSigma_rad = 0.25e-3;
  constexpr double kSigma_m = 0.5e-3;
  return isotropic_covariance(kSigma_rad * kSigma_rad, kSigma_m * kSigma_m);
}

/// What a pose inherits from the landmarks it was solved from: a landmark has the error of its anchor, the first keyframe that saw
/// it. The errors of anchors are correlated in ways nobody knows; the mean of their covariances, weighted by landmarks, bounds that
/// of the mean error whatever the correlation.
class InheritedDrift {
 public:
  void add(int landmarks, const Se3& T_anchor_camera, const Matrix6d& anchor_covariance) {
    const Matrix6d to_camera = T_anchor_camera.inverse().adjoint();
    sum_ += landmarks * (to_camera * anchor_covariance * to_camera.transpose());
    landmarks_ += landmarks;
  }

  /// Of the pose: `given_map` is what it would be if the landmarks were exact. Where nothing was added, the map begins here.
  Matrix6d covariance(const Matrix6d& given_map) const {
    if (landmarks_ == 0) {
      return given_map + start_covariance();
    }
    return given_map + (0.5 / landmarks_) * (sum_ + sum_.transpose());
  }

 private:
  Matrix6d sum_ = Matrix6d::Zero();
  int landmarks_ = 0;
};

}  // namespace posed
