#include "slam/pose_graph.h"

#include <exception>
#include <mutex>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include "slam/pose_graph_edge.h"
#include "slam/se3_manifold.h"

namespace posed {

namespace {

using Manifold = Se3Manifold;

class EdgeCost final : public ceres::SizedCostFunction<6, Manifold::kAmbientSize, Manifold::kAmbientSize> {
 public:
  explicit EdgeCost(const PoseGraphEdge& edge)
      : T_from_to_(edge.T_from_to), root_information_(Eigen::LLT<Matrix6d>(edge.information).matrixU()) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Se3 T_map_from = Manifold::from_coordinates(parameters[0]);
    const Se3 T_map_to = Manifold::from_coordinates(parameters[1]);
    Eigen::Map<Vector6d> weighted(residuals);
    if (jacobians == nullptr) {
      weighted = root_information_ * pose_graph::edge_residual(T_map_from, T_map_to, T_from_to_);
      return true;
    }
    const pose_graph::EdgeTerms t = pose_graph::linearise_edge(T_map_from, T_map_to, T_from_to_);
    weighted = root_information_ * t.xi;
    write_jacobian(t.by_from, jacobians[0]);
    write_jacobian(t.by_to, jacobians[1]);
    return true;
  }

 private:
  void write_jacobian(const Matrix6d& by_tangent, double* jacobian) const {
    if (jacobian != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 6, Manifold::kAmbientSize, Eigen::RowMajor>> out(jacobian);
      out.leftCols<6>() = root_information_ * by_tangent;
      out.rightCols<1>().setZero();
    }
  }

  Se3 T_from_to_;
  Matrix6d root_information_;
};

class InterruptCallback final : public ceres::IterationCallback {
 public:
  explicit InterruptCallback(const Interrupt& interrupt) : interrupt_(interrupt) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*summary*/) override {
    return is_interrupted(interrupt_) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Interrupt& interrupt_;
};

ceres::Solver::Options solver_options(int max_iterations) {
  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-9;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

PoseGraphSummary solve(PoseGraph& graph, int max_iterations, const Interrupt& interrupt) {
  Manifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  std::vector<Manifold::Coordinates> poses;
  for (const PoseGraphNode& node : graph.nodes) {
    poses.push_back(Manifold::to_coordinates(node.T_map_node));
  }
  for (std::size_t n = 0; n < poses.size(); ++n) {
    problem.AddParameterBlock(poses[n].data(), Manifold::kAmbientSize, &manifold);
    if (graph.nodes[n].fixed) {
      problem.SetParameterBlockConstant(poses[n].data());
    }
  }
  for (const PoseGraphEdge& edge : graph.edges) {
    problem.AddResidualBlock(new EdgeCost(edge), nullptr, poses[edge.from].data(), poses[edge.to].data());
  }
  ceres::Solver::Options options = solver_options(max_iterations);
  InterruptCallback callback(interrupt);
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary report;
  ceres::Solve(options, &problem, &report);

  PoseGraphSummary summary;
  summary.converged = report.termination_type == ceres::CONVERGENCE;
  summary.initial_cost = 2.0 * report.initial_cost;
  summary.final_cost = 2.0 * report.final_cost;
  summary.iterations = report.num_successful_steps + report.num_unsuccessful_steps;
  if (report.IsSolutionUsable()) {
    for (std::size_t n = 0; n < poses.size(); ++n) {
      if (!graph.nodes[n].fixed) {
        graph.nodes[n].T_map_node = Manifold::from_coordinates(poses[n].data());
      }
    }
  }
  return summary;
}

}  // namespace

Result<PoseGraphSummary> optimize_pose_graph(PoseGraph& graph, int max_iterations, const Interrupt& interrupt) {
  if (Status status = pose_graph::check(graph); !status) {
    return tl::unexpected(status.error());
  }
  static std::once_flag silenced;
  std::call_once(silenced, [] { FLAGS_minloglevel = google::GLOG_FATAL; });  // Ceres warns on the standard error output
  try {
    return solve(graph, max_iterations, interrupt);
  } catch (const std::exception& e) {
    return make_error(ErrorCode::Unavailable, fmt::format("pose graph of {} nodes: {}", graph.nodes.size(), e.what()));
  }
}

}  // namespace posed
