#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/pinhole_camera.h"
#include "slam/block_cholesky.h"
#include "slam/bundle_problem.h"
#include "slam/bundle_structure.h"
#include "slam/interrupt.h"
#include "slam/reprojection.h"

namespace posed {

/// Normal equations of a bundle adjustment and their solution by the Schur complement of the points: with U and V the blocks of
/// poses and points, W those between them, S = U - W V^-1 W^T is solved for the poses, and V for the points after it (Triggs et
/// al., 1999, section 6.1). `linearise` first, then `solve` as often as the damping changes, then `step_from`. Keeps its memory.
/// Thread-bound.
class SchurSolver {
 public:
  enum class Outcome { Solved, Singular, Interrupted };

  explicit SchurSolver(const CameraIntrinsics& intrinsics) : k_(intrinsics) {}

  /// Takes over the problem's structure: its active observations stay the same until the next call.
  void prepare(const BundleProblem& problem);
  const BundleStructure& structure() const { return structure_; }

  /// Cost of the active observations at the given poses and points. False: interrupted.
  bool evaluate(const std::vector<BundleCamera>& cameras, const std::vector<BundlePoint>& points, bool robust,
                const Interrupt& interrupt, double& cost);

  /// Normal equations at the given poses and points. False: interrupted.
  bool linearise(const std::vector<BundleCamera>& cameras, const std::vector<BundlePoint>& points, bool robust,
                 const Interrupt& interrupt);

  /// The step that minimises the linearised cost, with (1 + damping) times the diagonal.
  Outcome solve(double damping, const Interrupt& interrupt);

  /// What the linearised cost falls by with that step.
  double predicted_decrease() const { return predicted_decrease_; }

  /// The state after that step.
  void apply_step(const BundleProblem& problem, std::vector<BundleCamera>& cameras, std::vector<BundlePoint>& points) const;

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  struct PoseTerms {
    Matrix6d hessian;
    Vector6d gradient;
  };
  struct PointSystem {
    Eigen::Matrix3d hessian;
    Eigen::Vector3d gradient;
    Eigen::Matrix3d damped_inverse;
    Eigen::Vector3d step;
  };

  void project(const std::vector<BundleCamera>& cameras);
  void linearise_point(std::size_t point, const Eigen::Vector3d& p_map, bool robust);
  bool invert_points(double damping, const Interrupt& interrupt);
  bool reduce(double damping, const Interrupt& interrupt);
  void reduce_column(std::uint32_t column, double damping);
  bool substitute_back(double damping, const Interrupt& interrupt);

  CameraIntrinsics k_;
  BundleStructure structure_;
  BlockCholesky cholesky_;
  std::vector<reprojection::Projection> projections_;  // of all cameras
  std::vector<PoseTerms> poses_;                       // of the unknowns
  std::vector<PointSystem> points_;
  std::vector<Matrix63d> mixed_;  // W of each active observation of an unknown camera
  std::vector<Matrix6d> reduced_;
  std::vector<std::uint32_t> slot_;  // scratch: of an unknown in the present column of the reduced system
  Eigen::VectorXd pose_step_;
  double predicted_decrease_ = 0;
};

}  // namespace posed
