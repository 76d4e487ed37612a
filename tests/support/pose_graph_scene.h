#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "slam/pose_graph.h"

namespace posed {

struct PoseGraphScene {
  PoseGraph graph;  ///< the first node is fixed, the others stand where the noisy steps lead
  std::vector<PoseGraphNode> truth;
};

/// A walk round a square, `laps` times, heading along its sides: an edge for each step, with noise, and, where asked, edges without
/// noise from each node of a later lap to that of the first, and from the last to the first.
inline PoseGraphScene make_square_walk(int nodes_per_lap, int laps, double sigma_rad, double sigma_m, bool closed,
                                       unsigned seed = 1) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  PoseGraphScene scene;
  const int nodes = nodes_per_lap * laps;
  for (int n = 0; n < nodes; ++n) {
    const double s = 4.0 * (n % nodes_per_lap) / nodes_per_lap;
    const double side = std::floor(s);
    const double along = 10.0 * (s - side) - 5.0;
    const Se3 T_map_side(Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * std::numbers::pi * side, Eigen::Vector3d::UnitZ())),
                         Eigen::Vector3d::Zero());
    scene.truth.push_back({T_map_side * Se3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(along, -5.0, 0.3 * std::sin(s)))});
  }
  scene.truth.front().fixed = true;
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / std::max(1e-8, sigma_rad * sigma_rad)),
      Eigen::Vector3d::Constant(1.0 / std::max(1e-8, sigma_m * sigma_m));
  const auto true_step = [&](int from, int to) {
    return scene.truth[static_cast<std::size_t>(from)].T_map_node.inverse() * scene.truth[static_cast<std::size_t>(to)].T_map_node;
  };
  const auto add_edge = [&](int from, int to, const Se3& T_from_to) {
    scene.graph.edges.push_back(
        {static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to), T_from_to, information.asDiagonal()});
  };
  scene.graph.nodes.push_back(scene.truth.front());
  for (int n = 1; n < nodes; ++n) {
    Vector6d noise;
    for (int axis = 0; axis < 6; ++axis) {
      noise[axis] = (axis < 3 ? sigma_rad : sigma_m) * normal(generator);
    }
    const Se3 step = true_step(n - 1, n) * Se3::exp(noise);
    add_edge(n - 1, n, step);
    scene.graph.nodes.push_back({scene.graph.nodes.back().T_map_node * step, false});
  }
  if (closed) {
    for (int n = nodes_per_lap; n < nodes; ++n) {
      add_edge(n - nodes_per_lap, n, true_step(n - nodes_per_lap, n));
    }
    add_edge(nodes - 1, 0, true_step(nodes - 1, 0));
  }
  return scene;
}

}  // namespace posed
