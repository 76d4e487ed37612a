#include "slam/pose_solver.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "slam/reprojection.h"

namespace posed {

namespace {

// Cutting residuals off at these bounds takes away the tails: what remains of Gaussian residuals has this share of their variance,
// P(chi2_{d+2} < bound) / 0.95 for d degrees of freedom.
constexpr double kKeptVarianceTwoDof = 0.8423;
constexpr double kKeptVarianceThreeDof = 0.8771;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();  // of the step that lowers the cost: J^T W e
  double cost = 0;
};

/// Adds one observation. With p' = exp(-xi) p_camera: dp/dphi = skew(p), dp/drho = -I, so J = P * [S, -I] with P the projection's
/// derivative, and all that is needed of P is A = P^T W P and g = P^T W e.
void accumulate(const reprojection::Residual& r, const CameraIntrinsics& k, double robust_weight, NormalEquations& n) {
  const auto [a, g] = reprojection::point_terms(k, r, robust_weight);
  const Eigen::Matrix3d s = skew(r.p_camera);
  const Eigen::Matrix3d as = a * s;
  n.hessian.topLeftCorner<3, 3>().noalias() += s.transpose() * as;
  n.hessian.bottomLeftCorner<3, 3>() -= as;
  n.hessian.bottomRightCorner<3, 3>() += a;
  n.gradient.head<3>() += g.cross(r.p_camera);  // S^T g
  n.gradient.tail<3>() -= g;
}

/// Normal equations and robust cost (Huber's, with the square root of the chi-squared bound as its corner) over the inliers.
NormalEquations linearise(const PinholeCamera& camera, const Se3& T_map_camera, std::span<const PoseObservation> observations,
                          bool robust) {
  const reprojection::Projection projection(T_map_camera);
  NormalEquations n;
  for (const PoseObservation& o : observations) {
    if (!o.inlier) {
      continue;
    }
    const reprojection::Residual r = projection.residual(camera.intrinsics(), o, o.p_map);
    const double bound = reprojection::chi2_bound(o);
    n.cost += reprojection::cost(r.chi2, bound, robust);
    if (std::isfinite(r.chi2)) {
      accumulate(r, camera.intrinsics(), reprojection::robust_weight(r.chi2, bound, robust), n);
    }
  }
  n.hessian.triangularView<Eigen::StrictlyUpper>() = n.hessian.transpose();
  return n;
}

/// Levenberg-Marquardt until the step is negligible; returns the equations at the solution.
NormalEquations minimise(const PinholeCamera& camera, Se3& T_map_camera, std::span<const PoseObservation> observations, bool robust,
                         int max_iterations) {
  constexpr double kNegligibleStep2 = 1e-14;  // a tenth of a micrometre or microradian
  double damping = 1e-6;
  NormalEquations n = linearise(camera, T_map_camera, observations, robust);
  for (int i = 0; i < max_iterations; ++i) {
    Matrix6d damped = n.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Vector6d step = damped.ldlt().solve(n.gradient);
    if (!step.allFinite()) {
      break;
    }
    const Se3 candidate = T_map_camera * Se3::exp(step);
    const NormalEquations at_candidate = linearise(camera, candidate, observations, robust);
    if (at_candidate.cost > n.cost) {
      damping = std::max(damping, 1e-4) * 10.0;
      continue;
    }
    T_map_camera = candidate;
    n = at_candidate;
    damping *= 0.1;
    if (step.squaredNorm() < kNegligibleStep2) {
      break;
    }
  }
  return n;
}

/// Marks every observation anew; the sum of the inliers' chi-squared and their degrees of freedom.
struct Classification {
  int inliers = 0;
  int changed = 0;
  double chi2 = 0;
  int residuals = 0;
  double expected_chi2 = 0;  // of Gaussian residuals with the stated variances
};

Classification classify(const PinholeCamera& camera, const Se3& T_map_camera, std::span<PoseObservation> observations) {
  const reprojection::Projection projection(T_map_camera);
  Classification c;
  for (PoseObservation& o : observations) {
    const double chi2 = projection.residual(camera.intrinsics(), o, o.p_map).chi2;
    const bool inlier = chi2 <= reprojection::chi2_bound(o);
    c.changed += inlier != o.inlier ? 1 : 0;
    o.inlier = inlier;
    if (inlier) {
      ++c.inliers;
      c.chi2 += chi2;
      c.residuals += o.disparity > 0 ? 3 : 2;
      c.expected_chi2 += o.disparity > 0 ? 3 * kKeptVarianceThreeDof : 2 * kKeptVarianceTwoDof;
    }
  }
  return c;
}

}  // namespace

PoseSolution solve_pose(const PinholeCamera& camera, const Se3& initial_T_map_camera, std::span<PoseObservation> observations,
                        const PoseSolverOptions& options) {
  PoseSolution solution;
  solution.T_map_camera = initial_T_map_camera;
  NormalEquations n;
  Classification c;
  for (int round = 0; round < options.max_rounds; ++round) {
    const bool robust = round + 1 < options.max_rounds;
    n = minimise(camera, solution.T_map_camera, observations, robust, options.max_iterations);
    c = classify(camera, solution.T_map_camera, observations);
    if (c.inliers < options.min_inliers) {
      return solution;
    }
    if (!robust || (c.changed == 0 && round > 0)) {
      break;
    }
  }
  // The covariance belongs to the final set of inliers, without the kernel's weights.
  n = linearise(camera, solution.T_map_camera, observations, false);
  const Eigen::LDLT<Matrix6d> factor(n.hessian);
  if (factor.info() != Eigen::Success || !factor.isPositive() || factor.rcond() < 1e-12) {
    return solution;
  }
  // With residuals cut off, the estimate scatters more than the inverse Hessian says, by the reciprocal of the kept variance: the
  // asymptotic variance of a skipped mean (Huber, "Robust Statistics", 1981, section 4.7, with psi(x) = x up to the bound and 0
  // beyond).
  const double kept_variance = c.expected_chi2 / c.residuals;
  const double freedom = static_cast<double>(std::max(1, c.residuals - 6)) / c.residuals;
  solution.variance_factor = c.chi2 / (freedom * c.expected_chi2);
  solution.covariance = solution.variance_factor / kept_variance * factor.solve(Matrix6d::Identity());
  solution.inliers = c.inliers;
  solution.solved = solution.T_map_camera.is_finite() && solution.covariance.allFinite();
  return solution;
}

}  // namespace posed
