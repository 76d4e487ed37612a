#pragma once

#include "slam/pose_graph.h"

/// The residual of a pose graph's edge and its derivatives. Reentrant.
namespace posed::pose_graph {

/// J_r(xi)^-1 of SE(3), with log(T * exp(d)) = log(T) + J_r^-1(log(T)) d to first order: the Bernoulli series in ad(xi) (Barfoot,
/// 2017, section 7.1.5, has the left one; the right one is its value at -xi), cut off before its term -ad^8 / 1209600.
Matrix6d right_jacobian_inverse(const Vector6d& xi);

struct EdgeTerms {
  Vector6d xi;       // the residual
  Matrix6d by_from;  // its derivatives by the tangents of both nodes
  Matrix6d by_to;
};

/// log(T_from_to^-1 * T_map_from^-1 * T_map_to)
Vector6d edge_residual(const Se3& T_map_from, const Se3& T_map_to, const Se3& T_from_to);

EdgeTerms linearise_edge(const Se3& T_map_from, const Se3& T_map_to, const Se3& T_from_to);

/// What is wrong with the graph, if anything.
Status check(const PoseGraph& graph);

}  // namespace posed::pose_graph
