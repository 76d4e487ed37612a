#include "slam/schur_solver.h"

#include <cmath>

#include <Eigen/LU>

#include "slam/marquardt_damping.h"

namespace posed {

namespace {

constexpr std::size_t kPointsBetweenInterrupts = 256;

bool is_pause(std::size_t n, const Interrupt& interrupt) {
  return n % kPointsBetweenInterrupts == 0 && is_interrupted(interrupt);
}

}  // namespace

void SchurSolver::prepare(const BundleProblem& problem) {
  structure_.build(problem);
  cholesky_.analyze(structure_.pattern());
  poses_.resize(structure_.unknowns().size());
  points_.resize(structure_.points());
  mixed_.resize(structure_.observations().size());
  reduced_.resize(structure_.pattern().rows.size());
  slot_.resize(structure_.unknowns().size());
  pose_step_.resize(static_cast<Eigen::Index>(6 * structure_.unknowns().size()));
}

void SchurSolver::project(const std::vector<BundleCamera>& cameras) {
  projections_.clear();
  for (const BundleCamera& c : cameras) {
    projections_.emplace_back(c.T_map_camera);
  }
}

bool SchurSolver::evaluate(const std::vector<BundleCamera>& cameras, const std::vector<BundlePoint>& points, bool robust,
                           const Interrupt& interrupt, double& cost) {
  project(cameras);
  const std::vector<std::uint32_t>& offsets = structure_.point_offsets();
  cost = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (is_pause(p, interrupt)) {
      return false;
    }
    for (std::uint32_t n = offsets[p]; n < offsets[p + 1]; ++n) {
      const ActiveObservation& o = structure_.observations()[n];
      const reprojection::Residual r = projections_[o.camera].residual(k_, o, points[p].p_map);
      cost += reprojection::cost(r.chi2, reprojection::chi2_bound(o), robust);
    }
  }
  return true;
}

bool SchurSolver::linearise(const std::vector<BundleCamera>& cameras, const std::vector<BundlePoint>& points, bool robust,
                            const Interrupt& interrupt) {
  project(cameras);
  for (PoseTerms& pose : poses_) {
    pose.hessian.setZero();
    pose.gradient.setZero();
  }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (is_pause(p, interrupt)) {
      return false;
    }
    linearise_point(p, points[p].p_map, robust);
  }
  for (PoseTerms& pose : poses_) {
    pose.hessian.triangularView<Eigen::StrictlyUpper>() = pose.hessian.transpose();
  }
  return true;
}

/// With p_camera' = exp(-xi) (R (p_map + d) + t): its derivatives are [skew(p_camera), -I] by the pose's tangent xi and R by the
/// point's shift d.
void SchurSolver::linearise_point(std::size_t point, const Eigen::Vector3d& p_map, bool robust) {
  PointSystem& system = points_[point];
  system.hessian.setZero();
  system.gradient.setZero();
  const std::vector<std::uint32_t>& offsets = structure_.point_offsets();
  for (std::uint32_t n = offsets[point]; n < offsets[point + 1]; ++n) {
    const ActiveObservation& o = structure_.observations()[n];
    const reprojection::Projection& projection = projections_[o.camera];
    const reprojection::Residual r = projection.residual(k_, o, p_map);
    const double weight = reprojection::robust_weight(r.chi2, reprojection::chi2_bound(o), robust);
    if (weight == 0.0) {  // behind the camera
      mixed_[n].setZero();
      continue;
    }
    const reprojection::PointTerms t = reprojection::point_terms(k_, r, weight);
    const Eigen::Matrix3d a_r = t.information * projection.R_camera_map;
    system.hessian.noalias() += projection.R_camera_map.transpose() * a_r;
    system.gradient.noalias() += projection.R_camera_map.transpose() * t.gradient;
    if (o.unknown == BundleStructure::kFixedCamera) {
      continue;
    }
    const Eigen::Matrix3d s_transposed = -skew(r.p_camera);
    mixed_[n].topRows<3>().noalias() = s_transposed * a_r;
    mixed_[n].bottomRows<3>() = -a_r;
    PoseTerms& pose = poses_[static_cast<std::size_t>(o.unknown)];
    const Eigen::Matrix3d s_a = s_transposed * t.information;
    pose.hessian.topLeftCorner<3, 3>().noalias() -= s_a * s_transposed;
    pose.hessian.bottomLeftCorner<3, 3>() -= s_a.transpose();
    pose.hessian.bottomRightCorner<3, 3>() += t.information;
    pose.gradient.head<3>() += t.gradient.cross(r.p_camera);
    pose.gradient.tail<3>() -= t.gradient;
  }
}

SchurSolver::Outcome SchurSolver::solve(double damping, const Interrupt& interrupt) {
  if (!invert_points(damping, interrupt) || !reduce(damping, interrupt)) {
    return Outcome::Interrupted;
  }
  switch (cholesky_.factorize(reduced_, interrupt)) {
    case BlockCholesky::Outcome::Interrupted: return Outcome::Interrupted;
    case BlockCholesky::Outcome::NotPositiveDefinite: return Outcome::Singular;
    case BlockCholesky::Outcome::Factorized: break;
  }
  cholesky_.solve_in_place(pose_step_);
  if (!substitute_back(damping, interrupt)) {
    return Outcome::Interrupted;
  }
  return std::isfinite(predicted_decrease_) ? Outcome::Solved : Outcome::Singular;
}

bool SchurSolver::invert_points(double damping, const Interrupt& interrupt) {
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (is_pause(p, interrupt)) {
      return false;
    }
    PointSystem& system = points_[p];
    Eigen::Matrix3d damped = system.hessian;
    damped.diagonal() += MarquardtDamping::terms(system.hessian, damping);
    system.damped_inverse = damped.inverse();
    system.step.noalias() = system.damped_inverse * system.gradient;
  }
  return true;
}

bool SchurSolver::reduce(double damping, const Interrupt& interrupt) {
  for (std::uint32_t column = 0; column < poses_.size(); ++column) {
    if (is_interrupted(interrupt)) {
      return false;
    }
    reduce_column(column, damping);
  }
  return true;
}

/// One block column of S, and its part of the right-hand side.
void SchurSolver::reduce_column(std::uint32_t column, double damping) {
  const BlockPattern& pattern = structure_.pattern();
  for (std::uint32_t q = pattern.offsets[column]; q < pattern.offsets[column + 1]; ++q) {
    slot_[pattern.rows[q]] = q;
    reduced_[q].setZero();
  }
  const PoseTerms& pose = poses_[column];
  Matrix6d& diagonal = reduced_[pattern.offsets[column]];
  diagonal = pose.hessian;
  diagonal.diagonal() += MarquardtDamping::terms(pose.hessian, damping);
  Vector6d right_side = pose.gradient;

  const std::vector<ActiveObservation>& observations = structure_.observations();
  const std::vector<std::uint32_t>& offsets = structure_.point_offsets();
  for (std::uint32_t e = structure_.camera_offsets()[column]; e < structure_.camera_offsets()[column + 1]; ++e) {
    const BundleStructure::CameraEntry& entry = structure_.camera_entries()[e];
    const PointSystem& point = points_[entry.point];
    right_side.noalias() -= mixed_[entry.observation] * point.step;
    const Eigen::Matrix<double, 3, 6> eliminated = point.damped_inverse * mixed_[entry.observation].transpose();
    for (std::uint32_t n = offsets[entry.point]; n < offsets[entry.point + 1]; ++n) {
      const std::int32_t unknown = observations[n].unknown;
      if (unknown >= static_cast<std::int32_t>(column)) {
        reduced_[slot_[static_cast<std::size_t>(unknown)]].noalias() -= mixed_[n] * eliminated;
      }
    }
  }
  pose_step_.segment<6>(static_cast<Eigen::Index>(6 * column)) = right_side;
}

bool SchurSolver::substitute_back(double damping, const Interrupt& interrupt) {
  const std::vector<ActiveObservation>& observations = structure_.observations();
  const std::vector<std::uint32_t>& offsets = structure_.point_offsets();
  predicted_decrease_ = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (is_pause(p, interrupt)) {
      return false;
    }
    PointSystem& point = points_[p];
    Eigen::Vector3d right_side = point.gradient;
    for (std::uint32_t n = offsets[p]; n < offsets[p + 1]; ++n) {
      const std::int32_t unknown = observations[n].unknown;
      if (unknown != BundleStructure::kFixedCamera) {
        right_side.noalias() -= mixed_[n].transpose() * pose_step_.segment<6>(static_cast<Eigen::Index>(6 * unknown));
      }
    }
    point.step.noalias() = point.damped_inverse * right_side;
    predicted_decrease_ +=
        point.step.dot(point.gradient + MarquardtDamping::terms(point.hessian, damping).cwiseProduct(point.step));
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const Vector6d step = pose_step_.segment<6>(static_cast<Eigen::Index>(6 * i));
    predicted_decrease_ += step.dot(poses_[i].gradient + MarquardtDamping::terms(poses_[i].hessian, damping).cwiseProduct(step));
  }
  return true;
}

void SchurSolver::apply_step(const BundleProblem& problem, std::vector<BundleCamera>& cameras,
                             std::vector<BundlePoint>& points) const {
  cameras = problem.cameras;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    Se3& pose = cameras[structure_.unknowns()[i]].T_map_camera;
    pose = pose * Se3::exp(pose_step_.segment<6>(static_cast<Eigen::Index>(6 * i)));
  }
  points = problem.points;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    points[p].p_map += points_[p].step;
  }
}

}  // namespace posed
