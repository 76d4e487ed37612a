#pragma once

#include <memory>

#include "core/pinhole_camera.h"
#include "slam/bundle_problem.h"
#include "slam/interrupt.h"

namespace posed {

/// Minimises the robust reprojection error over camera poses and points together: Levenberg-Marquardt on the Schur complement of
/// the points (Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment - a modern synthesis", 1999, sections 4 and 6), with
/// the damping of Madsen, Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004, section 3.2. The tangent of a
/// pose is that of Se3.
///
/// Keeps its memory between calls: one adjuster for each thread that adjusts. Thread-bound. The same problem gives the same bits.
class BundleAdjuster {
 public:
  explicit BundleAdjuster(const PinholeCamera& camera);
  ~BundleAdjuster();
  BundleAdjuster(BundleAdjuster&&) noexcept;
  BundleAdjuster& operator=(BundleAdjuster&&) noexcept;

  /// Moves the free cameras and the points of `problem` and sets the observations' inlier flags. Indices in the observations must
  /// be in range. Where no camera is fixed, the first is held, so that the result has a place and an orientation. What nothing
  /// determines stays where it is: cameras and points without an active observation, and points that one camera alone saw without
  /// depth.
  ///
  /// An interrupt is honoured within a fraction of an iteration. The problem then holds the result of the last accepted step, and
  /// every accepted step has lowered its round's cost. The flags are always those of the poses and points that are returned, so
  /// after an early interrupt they also condemn what further steps might have mended.
  BundleSummary solve(BundleProblem& problem, const BundleOptions& options, const Interrupt& interrupt = {});

 private:
  class Minimiser;
  std::unique_ptr<Minimiser> minimiser_;
};

}  // namespace posed
