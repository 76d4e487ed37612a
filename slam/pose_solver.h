#pragma once

#include <span>

#include "core/pinhole_camera.h"
#include "core/se3.h"

namespace posed {

/// One landmark seen in the frame whose pose is sought.
struct PoseObservation {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();        ///< [m]
  Eigen::Vector2d ideal_pixel = Eigen::Vector2d::Zero();  ///< undistorted keypoint
  double disparity = 0;                                   ///< baseline_fx / depth [pixels]; 0 where the sensor saw no depth
  double pixel_weight = 1;                                ///< 1 / variance of each pixel coordinate
  double disparity_weight = 1;                            ///< 1 / variance of the disparity
  bool inlier = true;                                     ///< result: chi-squared below the 95 % bound at the solution
};

struct PoseSolverOptions {
  int max_rounds = 4;       ///< of minimising and telling inliers from outliers; Huber's kernel acts in all but the last
  int max_iterations = 10;  ///< a round
  int min_inliers = 6;      ///< fewer: no solution
};

struct PoseSolution {
  bool solved = false;  ///< false: too few inliers or a degenerate geometry; the other members mean nothing then
  Se3 T_map_camera;
  /// Of xi = (phi, rho) in T_map_camera * exp(xi) [rad, m], given the map (whose own error is not in it): the inverse of the
  /// Gauss-Newton Hessian of the inliers, scaled by their variance factor and corrected for the outliers' being cut off.
  Matrix6d covariance = Matrix6d::Zero();
  int inliers = 0;
  double variance_factor = 1;  ///< observed over stated variance of the residuals; 1: the stated noise is right
};

/// Minimises the robust reprojection error over the camera's pose, the landmarks held fixed. Residuals of an observation: both
/// pixel coordinates and, where there is depth, the disparity u - u_r of the virtual stereo pair (Mur-Artal and Tardos,
/// "ORB-SLAM2", T-RO 2017, section III-A, use u_r itself; the difference u - u_r has an error that is independent of u's, so it can
/// be weighted as the depth sensor deserves). Iteratively reweighted Levenberg-Marquardt with Huber's kernel; the tangent is that
/// of Se3. `observations`: their `inlier` flags are read as the first guess and overwritten. Does not allocate. Reentrant.
PoseSolution solve_pose(const PinholeCamera& camera, const Se3& initial_T_map_camera, std::span<PoseObservation> observations,
                        const PoseSolverOptions& options = {});

}  // namespace posed
