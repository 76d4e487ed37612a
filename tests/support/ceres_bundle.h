#pragma once

#include "core/pinhole_camera.h"
#include "slam/bundle_problem.h"

namespace posed {

/// What Ceres's linear solver does with the reduced camera system.
enum class CeresSchur { Dense, Sparse, Iterative };

struct CeresBundleTimes {
  double total_s = 0;  ///< of the solves, without building Ceres's problem
  int iterations = 0;
};

/// The problem of BundleAdjuster::solve, solved by Ceres with analytic derivatives on one thread: the same residuals, kernel,
/// rounds and classification. At least one camera must be fixed, and no point may start behind a camera that sees it.
CeresBundleTimes solve_bundle_with_ceres(const PinholeCamera& camera, BundleProblem& problem, const BundleOptions& options,
                                         CeresSchur schur);

}  // namespace posed
