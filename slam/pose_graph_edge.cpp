#include "slam/pose_graph_edge.h"

#include <algorithm>

#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace posed::pose_graph {

Matrix6d right_jacobian_inverse(const Vector6d& xi) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = skew(xi.head<3>());
  ad.bottomRightCorner<3, 3>() = ad.topLeftCorner<3, 3>();
  ad.bottomLeftCorner<3, 3>() = skew(xi.tail<3>());
  const Matrix6d ad2 = ad * ad;
  const Matrix6d ad4 = ad2 * ad2;
  return Matrix6d::Identity() + ad / 2.0 + ad2 / 12.0 - ad4 / 720.0 + ad4 * ad2 / 30240.0;
}

Vector6d edge_residual(const Se3& T_map_from, const Se3& T_map_to, const Se3& T_from_to) {
  return (T_from_to.inverse() * T_map_from.inverse() * T_map_to).log();
}

EdgeTerms linearise_edge(const Se3& T_map_from, const Se3& T_map_to, const Se3& T_from_to) {
  EdgeTerms t;
  t.xi = edge_residual(T_map_from, T_map_to, T_from_to);
  t.by_to = right_jacobian_inverse(t.xi);
  // exp(-d) * X = X * exp(-Ad(X^-1) d), with X = T_map_from^-1 * T_map_to.
  t.by_from = -t.by_to * (T_map_to.inverse() * T_map_from).adjoint();
  return t;
}

Status check(const PoseGraph& graph) {
  if (std::none_of(graph.nodes.begin(), graph.nodes.end(), [](const PoseGraphNode& n) { return n.fixed; })) {
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("pose graph: none of its {} nodes is fixed; fix one, so that the map has a place", graph.nodes.size()));
  }
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    if (!graph.nodes[n].T_map_node.is_finite()) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("pose graph: the pose of node {} is not finite", n));
    }
  }
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const PoseGraphEdge& edge = graph.edges[e];
    if (edge.from >= graph.nodes.size() || edge.to >= graph.nodes.size() || edge.from == edge.to) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("pose graph: edge {} joins nodes {} and {}; they must differ and be less than {}", e, edge.from,
                                    edge.to, graph.nodes.size()));
    }
    const Eigen::LLT<Matrix6d> factor(edge.information);
    if (!edge.T_from_to.is_finite() || !edge.information.allFinite() || factor.info() != Eigen::Success) {
      return make_error(
          ErrorCode::InvalidArgument,
          fmt::format("pose graph: edge {} from node {} to {} needs a finite pose and a positive definite information matrix", e,
                      edge.from, edge.to));
    }
  }
  return {};
}

}  // namespace posed::pose_graph
