#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/se3.h"

namespace posed {

/// A camera's pose in a bundle adjustment.
struct BundleCamera {
  Se3 T_map_camera;
  bool fixed = false;  ///< its pose is given; the adjustment does not move it
};

/// A landmark's position in a bundle adjustment.
struct BundlePoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();  ///< [m]
};

/// One point seen by one camera. The residuals are those of PoseObservation (slam/pose_solver.h).
struct BundleObservation {
  std::uint32_t camera = 0;                               ///< index into BundleProblem::cameras
  std::uint32_t point = 0;                                ///< index into BundleProblem::points
  Eigen::Vector2d ideal_pixel = Eigen::Vector2d::Zero();  ///< undistorted keypoint
  double disparity = 0;                                   ///< baseline_fx / depth [pixels]; 0 where the sensor saw no depth
  double pixel_weight = 1;                                ///< 1 / variance of each pixel coordinate
  double disparity_weight = 1;                            ///< 1 / variance of the disparity
  bool inlier = true;                                     ///< read: takes part in the first round; result: chi-squared below
                                                          ///< the 95 % bound
};

/// Poses, points and what the cameras saw of the points. A value: it knows nothing of the map it was taken from.
struct BundleProblem {
  std::vector<BundleCamera> cameras;
  std::vector<BundlePoint> points;
  std::vector<BundleObservation> observations;

  /// Empties the problem and keeps its memory.
  void clear() {
    cameras.clear();
    points.clear();
    observations.clear();
  }
};

struct BundleOptions {
  int max_iterations = 10;       ///< a round; iterations whose step is refused count too
  int rounds = 2;                ///< of minimising and telling inliers from outliers; Huber's kernel acts in all but the last
  double cost_tolerance = 1e-6;  ///< a step that lowers the cost by a smaller share ends its round
};

enum class BundleOutcome {
  Converged,       ///< the last round ended because its steps had become negligible
  IterationLimit,  ///< the last round ended at max_iterations
  Interrupted,     ///< the caller asked to stop
  Degenerate,      ///< a round had no observation to adjust to, or equations that no damping made solvable
};

struct BundleSummary {
  BundleOutcome outcome = BundleOutcome::Degenerate;
  double initial_cost = 0;  ///< sum of Huber's cost over the observations that were inliers at the start
  double final_cost = 0;    ///< the same sum, over the same observations, at the result
  int iterations = 0;       ///< of all rounds
};

}  // namespace posed
