#include "slam/bundle_adjuster.h"

#include "slam/marquardt_damping.h"
#include "slam/schur_solver.h"

namespace posed {

class BundleAdjuster::Minimiser {
 public:
  explicit Minimiser(const CameraIntrinsics& intrinsics) : k_(intrinsics), solver_(intrinsics) {}

  BundleSummary solve(BundleProblem& problem, const BundleOptions& options, const Interrupt& interrupt);

 private:
  BundleOutcome run_round(BundleProblem& problem, const BundleOptions& options, bool robust, const Interrupt& interrupt,
                          int& iterations);
  double cost_of_first_inliers(const BundleProblem& problem);
  void mark_inliers(BundleProblem& problem);

  CameraIntrinsics k_;
  SchurSolver solver_;
  std::vector<BundleCamera> candidate_cameras_;
  std::vector<BundlePoint> candidate_points_;
  std::vector<reprojection::Projection> projections_;
  std::vector<std::uint32_t> first_inliers_;  // the observations that were inliers at the start
};

BundleSummary BundleAdjuster::Minimiser::solve(BundleProblem& problem, const BundleOptions& options, const Interrupt& interrupt) {
  first_inliers_.clear();
  for (std::uint32_t n = 0; n < problem.observations.size(); ++n) {
    if (problem.observations[n].inlier) {
      first_inliers_.push_back(n);
    }
  }
  BundleSummary summary;
  summary.initial_cost = cost_of_first_inliers(problem);
  for (int round = 0; round < options.rounds; ++round) {
    const bool robust = round + 1 < options.rounds;
    summary.outcome = run_round(problem, options, robust, interrupt, summary.iterations);
    mark_inliers(problem);
    if (summary.outcome == BundleOutcome::Interrupted || summary.outcome == BundleOutcome::Degenerate) {
      break;
    }
  }
  summary.final_cost = cost_of_first_inliers(problem);
  return summary;
}

BundleOutcome BundleAdjuster::Minimiser::run_round(BundleProblem& problem, const BundleOptions& options, bool robust,
                                                   const Interrupt& interrupt, int& iterations) {
  solver_.prepare(problem);
  if (solver_.structure().observations().empty()) {
    return BundleOutcome::Degenerate;
  }
  double cost = 0;
  if (!solver_.evaluate(problem.cameras, problem.points, robust, interrupt, cost)) {
    return BundleOutcome::Interrupted;
  }
  MarquardtDamping damping;
  bool is_linearised = false;
  for (int i = 0; i < options.max_iterations; ++i) {
    if (!is_linearised && !solver_.linearise(problem.cameras, problem.points, robust, interrupt)) {
      return BundleOutcome::Interrupted;
    }
    is_linearised = true;
    ++iterations;
    const SchurSolver::Outcome step = solver_.solve(damping.value(), interrupt);
    if (step == SchurSolver::Outcome::Interrupted) {
      return BundleOutcome::Interrupted;
    }
    if (step == SchurSolver::Outcome::Singular) {
      damping.refused();
      if (damping.is_exhausted()) {
        return BundleOutcome::Degenerate;
      }
      continue;
    }
    solver_.apply_step(problem, candidate_cameras_, candidate_points_);
    double candidate_cost = 0;
    if (!solver_.evaluate(candidate_cameras_, candidate_points_, robust, interrupt, candidate_cost)) {
      return BundleOutcome::Interrupted;
    }
    const double decrease = cost - candidate_cost;
    const double negligible = options.cost_tolerance * cost;
    if (!(decrease > 0)) {
      damping.refused();
      if (solver_.predicted_decrease() <= negligible || damping.is_exhausted()) {
        return BundleOutcome::Converged;
      }
      continue;
    }
    problem.cameras = candidate_cameras_;
    problem.points = candidate_points_;
    if (decrease <= negligible) {
      return BundleOutcome::Converged;
    }
    cost = candidate_cost;
    is_linearised = false;
    damping.accepted(decrease / solver_.predicted_decrease());
  }
  return BundleOutcome::IterationLimit;
}

double BundleAdjuster::Minimiser::cost_of_first_inliers(const BundleProblem& problem) {
  projections_.clear();
  for (const BundleCamera& c : problem.cameras) {
    projections_.emplace_back(c.T_map_camera);
  }
  double cost = 0;
  for (const std::uint32_t n : first_inliers_) {
    const BundleObservation& o = problem.observations[n];
    const reprojection::Residual r = projections_[o.camera].residual(k_, o, problem.points[o.point].p_map);
    cost += reprojection::cost(r.chi2, reprojection::chi2_bound(o), true);
  }
  return cost;
}

void BundleAdjuster::Minimiser::mark_inliers(BundleProblem& problem) {
  projections_.clear();
  for (const BundleCamera& c : problem.cameras) {
    projections_.emplace_back(c.T_map_camera);
  }
  for (BundleObservation& o : problem.observations) {
    o.inlier = projections_[o.camera].residual(k_, o, problem.points[o.point].p_map).chi2 <= reprojection::chi2_bound(o);
  }
}

BundleAdjuster::BundleAdjuster(const PinholeCamera& camera) : minimiser_(std::make_unique<Minimiser>(camera.intrinsics())) {}
BundleAdjuster::~BundleAdjuster() = default;
BundleAdjuster::BundleAdjuster(BundleAdjuster&&) noexcept = default;
BundleAdjuster& BundleAdjuster::operator=(BundleAdjuster&&) noexcept = default;

BundleSummary BundleAdjuster::solve(BundleProblem& problem, const BundleOptions& options, const Interrupt& interrupt) {
  return minimiser_->solve(problem, options, interrupt);
}

}  // namespace posed
