#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "core/pinhole_camera.h"
#include "core/se3.h"

/// The measurement model of a landmark in an RGB-D image, for those who adjust to it: u, v and, where there is depth, the disparity
/// u - u_r of the virtual stereo pair (see slam/pose_solver.h). Reentrant.
namespace posed::reprojection {

// 95 % quantiles of the chi-squared distribution with 2 and 3 degrees of freedom.
constexpr double kChi2TwoDof = 5.991;
constexpr double kChi2ThreeDof = 7.815;
constexpr double kMinDepth = 1e-3;  // [m] nearer, or behind: the projection says nothing
/// What an observation whose point is behind the camera costs, in chi-squared bounds: a constant, so that a step that puts a point
/// there does not look like progress.
constexpr double kBehindPenalty = 4.0;

/// `Observation` has ideal_pixel, disparity, pixel_weight and disparity_weight as PoseObservation has them.
template <typename Observation>
double chi2_bound(const Observation& o) {
  return o.disparity > 0 ? kChi2ThreeDof : kChi2TwoDof;
}

struct Residual {
  Eigen::Vector3d p_camera;
  Eigen::Vector3d error;                                  // measured minus predicted: u, v, disparity
  Eigen::Vector3d weight;                                 // zero for the disparity where there is none
  double chi2 = std::numeric_limits<double>::infinity();  // infinite: behind the camera; error and weight mean nothing
};

/// A pose in the form that inner loops want.
struct Projection {
  Eigen::Matrix3d R_camera_map;
  Eigen::Vector3d t_camera_map;

  explicit Projection(const Se3& T_map_camera)
      : R_camera_map(T_map_camera.rotation_matrix().transpose()), t_camera_map(-(R_camera_map * T_map_camera.translation())) {}

  template <typename Observation>
  Residual residual(const CameraIntrinsics& k, const Observation& o, const Eigen::Vector3d& p_map) const {
    Residual r;
    r.p_camera = R_camera_map * p_map + t_camera_map;
    if (!(r.p_camera.z() >= kMinDepth)) {  // a position that is not a number ends here too
      return r;
    }
    const double inverse_z = 1.0 / r.p_camera.z();
    const bool has_depth = o.disparity > 0;
    r.error << o.ideal_pixel.x() - (k.fx * r.p_camera.x() * inverse_z + k.cx),
        o.ideal_pixel.y() - (k.fy * r.p_camera.y() * inverse_z + k.cy), has_depth ? o.disparity - k.baseline_fx * inverse_z : 0.0;
    r.weight << o.pixel_weight, o.pixel_weight, has_depth ? o.disparity_weight : 0.0;
    r.chi2 = (r.weight.array() * r.error.array().square()).sum();
    return r;
  }
};

/// Cost of a residual: its chi-squared, or Huber's with the square root of the bound as its corner.
inline double cost(double chi2, double bound, bool robust) {
  if (chi2 == std::numeric_limits<double>::infinity()) {
    return kBehindPenalty * bound;
  }
  return robust && chi2 > bound ? 2.0 * std::sqrt(bound * chi2) - bound : chi2;
}

/// Weight of a residual in iteratively reweighted least squares with that cost; 0 behind the camera.
inline double robust_weight(double chi2, double bound, bool robust) {
  if (chi2 == std::numeric_limits<double>::infinity()) {
    return 0.0;
  }
  return robust && chi2 > bound ? std::sqrt(bound / chi2) : 1.0;
}

/// With P the derivative of (u, v, disparity) by p_camera and W the weights: P^T W P and P^T W e, all that normal equations need.
struct PointTerms {
  Eigen::Matrix3d information;
  Eigen::Vector3d gradient;
};

inline PointTerms point_terms(const CameraIntrinsics& k, const Residual& r, double robust_weight) {
  const double inverse_z = 1.0 / r.p_camera.z();
  const double inverse_z2 = inverse_z * inverse_z;
  const double px = k.fx * inverse_z;
  const double pxz = -k.fx * r.p_camera.x() * inverse_z2;
  const double py = k.fy * inverse_z;
  const double pyz = -k.fy * r.p_camera.y() * inverse_z2;
  const double pd = -k.baseline_fx * inverse_z2;
  const Eigen::Vector3d w = robust_weight * r.weight;

  PointTerms t;
  t.information << w.x() * px * px, 0.0, w.x() * px * pxz,  //
      0.0, w.y() * py * py, w.y() * py * pyz,               //
      w.x() * px * pxz, w.y() * py * pyz, w.x() * pxz * pxz + w.y() * pyz * pyz + w.z() * pd * pd;
  t.gradient << w.x() * px * r.error.x(), w.y() * py * r.error.y(),
      w.x() * pxz * r.error.x() + w.y() * pyz * r.error.y() + w.z() * pd * r.error.z();
  return t;
}

}  // namespace posed::reprojection
