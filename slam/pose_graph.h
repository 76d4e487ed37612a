#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "core/se3.h"
#include "slam/interrupt.h"

namespace posed {

/// A pose that the graph moves.
struct PoseGraphNode {
  Se3 T_map_node;
  bool fixed = false;  ///< its pose is given; the optimisation does not move it
};

/// A measured pose of one node relative to another.
struct PoseGraphEdge {
  std::uint32_t from = 0;  ///< indices into PoseGraph::nodes
  std::uint32_t to = 0;
  Se3 T_from_to;
  Matrix6d information = Matrix6d::Identity();  ///< inverse covariance of xi [rad, m] in T_from_to * exp(xi); positive definite
};

/// A value: it knows nothing of the map it was taken from.
struct PoseGraph {
  std::vector<PoseGraphNode> nodes;
  std::vector<PoseGraphEdge> edges;
};

struct PoseGraphSummary {
  bool converged = false;   ///< false: interrupted, or ended at the limit of iterations
  double initial_cost = 0;  ///< sum of xi^T information xi over the edges
  double final_cost = 0;    ///< the same at the result; never more
  int iterations = 0;
};

/// Moves the free nodes to where the measured relative poses agree best, by Levenberg-Marquardt. The residual of an edge is
/// xi = log(T_from_to^-1 * T_map_from^-1 * T_map_to), with derivatives by the series of the right Jacobian's inverse on SE(3)
/// (Barfoot, "State estimation for robotics", 2017, section 7.1.5). Nodes that no edge joins to a fixed one by any path keep their
/// common freedom and move as little as the damping lets them.
///
/// Interrupted, the graph holds the result of the last accepted step, which is no worse than the start. Deterministic. Reentrant.
/// Errors: InvalidArgument where an edge names a node that does not exist or joins a node to itself, where an information matrix is
/// not positive definite, where a pose is not finite, or where no node is fixed; the graph is then as it was.
Result<PoseGraphSummary> optimize_pose_graph(PoseGraph& graph, int max_iterations, const Interrupt& interrupt = {});

}  // namespace posed
