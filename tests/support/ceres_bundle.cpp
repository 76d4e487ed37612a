#include "tests/support/ceres_bundle.h"

#include <array>
#include <cmath>

#include <ceres/ceres.h>

#include "tests/support/se3_manifold.h"

namespace posed {

namespace {

double chi2_bound(const BundleObservation& o) {
  return o.disparity > 0 ? 7.815 : 5.991;
}

/// Predicted minus measured, over the standard deviation. Written from the camera model, not shared with the solver under test.
template <int kResiduals>
class ReprojectionCost final : public ceres::SizedCostFunction<kResiduals, Se3Manifold::kAmbientSize, 3> {
 public:
  ReprojectionCost(const CameraIntrinsics& k, const BundleObservation& o) : k_(k), o_(o) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Se3 T_camera_map = Se3Manifold::from_coordinates(parameters[0]).inverse();
    const Eigen::Vector3d p = T_camera_map * Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(parameters[1]));
    if (p.z() <= 0) {
      return false;
    }
    const Eigen::Vector3d all(k_.fx * p.x() / p.z() + k_.cx - o_.ideal_pixel.x(),
                              k_.fy * p.y() / p.z() + k_.cy - o_.ideal_pixel.y(), k_.baseline_fx / p.z() - o_.disparity);
    const Eigen::Vector3d scale(std::sqrt(o_.pixel_weight), std::sqrt(o_.pixel_weight), std::sqrt(o_.disparity_weight));
    Eigen::Map<Eigen::Matrix<double, kResiduals, 1>>(residuals, kResiduals) = scale.cwiseProduct(all).template head<kResiduals>();
    if (jacobians == nullptr) {
      return true;
    }
    Eigen::Matrix3d projection;
    projection << k_.fx / p.z(), 0, -k_.fx * p.x() / (p.z() * p.z()),  //
        0, k_.fy / p.z(), -k_.fy * p.y() / (p.z() * p.z()),            //
        0, 0, -k_.baseline_fx / (p.z() * p.z());
    const Eigen::Matrix<double, kResiduals, 3> scaled = (scale.asDiagonal() * projection).template topRows<kResiduals>();
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kResiduals, Se3Manifold::kAmbientSize, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.template leftCols<3>() = scaled * skew(p);
      by_pose.template middleCols<3>(3) = -scaled;
      by_pose.template rightCols<1>().setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kResiduals, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point = scaled * T_camera_map.rotation_matrix();
    }
    return true;
  }

 private:
  CameraIntrinsics k_;
  BundleObservation o_;
};

ceres::Solver::Options solver_options(const BundleOptions& options, CeresSchur schur) {
  ceres::Solver::Options o;
  o.max_num_iterations = options.max_iterations;
  o.function_tolerance = options.cost_tolerance;
  o.gradient_tolerance = 0;
  o.parameter_tolerance = 0;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  switch (schur) {
    case CeresSchur::Dense: o.linear_solver_type = ceres::DENSE_SCHUR; break;
    case CeresSchur::Sparse: o.linear_solver_type = ceres::SPARSE_SCHUR; break;
    case CeresSchur::Iterative:
      o.linear_solver_type = ceres::ITERATIVE_SCHUR;
      o.preconditioner_type = ceres::SCHUR_JACOBI;
      break;
  }
  return o;
}

ceres::Solver::Summary run_round(const PinholeCamera& camera, BundleProblem& problem, const BundleOptions& options,
                                 CeresSchur schur, bool robust) {
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  Se3Manifold manifold;
  ceres::HuberLoss pixel_loss(std::sqrt(5.991));
  ceres::HuberLoss disparity_loss(std::sqrt(7.815));
  std::vector<Se3Manifold::Coordinates> poses;
  for (const BundleCamera& c : problem.cameras) {
    poses.push_back(Se3Manifold::to_coordinates(c.T_map_camera));
  }
  ceres::Problem ceres_problem(problem_options);
  auto* ordering = new ceres::ParameterBlockOrdering;  // Ceres's options own it
  for (const BundleObservation& o : problem.observations) {
    if (!o.inlier) {
      continue;
    }
    double* pose = poses[o.camera].data();
    double* point = problem.points[o.point].p_map.data();
    if (o.disparity > 0) {
      ceres_problem.AddResidualBlock(new ReprojectionCost<3>(camera.intrinsics(), o), robust ? &disparity_loss : nullptr, pose,
                                     point);
    } else {
      ceres_problem.AddResidualBlock(new ReprojectionCost<2>(camera.intrinsics(), o), robust ? &pixel_loss : nullptr, pose, point);
    }
    ordering->AddElementToGroup(point, 0);
    ordering->AddElementToGroup(pose, 1);
  }
  for (std::size_t c = 0; c < poses.size(); ++c) {
    if (!ceres_problem.HasParameterBlock(poses[c].data())) {
      continue;
    }
    ceres_problem.SetManifold(poses[c].data(), &manifold);
    if (problem.cameras[c].fixed) {
      ceres_problem.SetParameterBlockConstant(poses[c].data());
    }
  }
  ceres::Solver::Options solver = solver_options(options, schur);
  solver.linear_solver_ordering.reset(ordering);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  for (std::size_t c = 0; c < poses.size(); ++c) {
    if (!problem.cameras[c].fixed) {
      problem.cameras[c].T_map_camera = Se3Manifold::from_coordinates(poses[c].data());
    }
  }
  return summary;
}

void mark_inliers(const PinholeCamera& camera, BundleProblem& problem) {
  for (BundleObservation& o : problem.observations) {
    const Eigen::Vector3d p = problem.cameras[o.camera].T_map_camera.inverse() * problem.points[o.point].p_map;
    const double disparity_error = o.disparity > 0 ? camera.intrinsics().baseline_fx / p.z() - o.disparity : 0.0;
    const double chi2 =
        o.pixel_weight * (camera.project(p) - o.ideal_pixel).squaredNorm() + o.disparity_weight * disparity_error * disparity_error;
    o.inlier = p.z() > 0 && chi2 <= chi2_bound(o);
  }
}

}  // namespace

CeresBundleTimes solve_bundle_with_ceres(const PinholeCamera& camera, BundleProblem& problem, const BundleOptions& options,
                                         CeresSchur schur) {
  CeresBundleTimes times;
  for (int round = 0; round < options.rounds; ++round) {
    const ceres::Solver::Summary summary = run_round(camera, problem, options, schur, round + 1 < options.rounds);
    times.total_s += summary.total_time_in_seconds;
    times.iterations += summary.num_successful_steps + summary.num_unsuccessful_steps - 1;  // the first is the start
    mark_inliers(camera, problem);
  }
  return times;
}

}  // namespace posed
