#include "slam/pose_graph.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "slam/pose_graph_edge.h"
#include "tests/support/pose_graph_scene.h"

namespace posed {
namespace {

double rms_m(const std::vector<PoseGraphNode>& a, const std::vector<PoseGraphNode>& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    sum += (a[n].T_map_node.translation() - b[n].T_map_node.translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

bool same_bits(const PoseGraph& a, const PoseGraph& b) {
  return std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(),
                    [](const PoseGraphNode& x, const PoseGraphNode& y) {
                      return x.T_map_node.rotation().coeffs() == y.T_map_node.rotation().coeffs() &&
                             x.T_map_node.translation() == y.T_map_node.translation();
                    });
}

double cost_of(const PoseGraph& graph) {
  double cost = 0;
  for (const PoseGraphEdge& e : graph.edges) {
    const Vector6d xi = pose_graph::edge_residual(graph.nodes[e.from].T_map_node, graph.nodes[e.to].T_map_node, e.T_from_to);
    cost += xi.dot(e.information * xi);
  }
  return cost;
}

TEST(PoseGraph, DerivativesAreTheNumericalOnes) {
  const Se3 T_map_from = Se3::exp((Vector6d() << 0.3, -1.2, 0.5, 1, 2, 3).finished());
  const Se3 T_from_to = Se3::exp((Vector6d() << -0.2, 0.4, 0.9, -1, 0.5, 0.2).finished());
  const Se3 T_map_to = T_map_from * T_from_to * Se3::exp((Vector6d() << 0.3, -0.2, 0.3, 0.4, -0.3, 0.2).finished());
  const pose_graph::EdgeTerms terms = pose_graph::linearise_edge(T_map_from, T_map_to, T_from_to);
  constexpr double kStep = 1e-6;
  for (int axis = 0; axis < 6; ++axis) {
    const Se3 plus = Se3::exp(kStep * Vector6d::Unit(axis));
    const Se3 minus = Se3::exp(-kStep * Vector6d::Unit(axis));
    const Vector6d by_from = (pose_graph::edge_residual(T_map_from * plus, T_map_to, T_from_to) -
                              pose_graph::edge_residual(T_map_from * minus, T_map_to, T_from_to)) /
                             (2 * kStep);
    const Vector6d by_to = (pose_graph::edge_residual(T_map_from, T_map_to * plus, T_from_to) -
                            pose_graph::edge_residual(T_map_from, T_map_to * minus, T_from_to)) /
                           (2 * kStep);
    EXPECT_LT((by_from - terms.by_from.col(axis)).norm(), 1e-5) << axis;
    EXPECT_LT((by_to - terms.by_to.col(axis)).norm(), 1e-5) << axis;
  }
}

TEST(PoseGraph, AClosedLoopTakesTheDriftAway) {
  PoseGraphScene scene = make_square_walk(80, 1, 0.005, 0.02, true);
  const double before = rms_m(scene.truth, scene.graph.nodes);
  const Result<PoseGraphSummary> summary = optimize_pose_graph(scene.graph, 50);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_TRUE(summary->converged);
  EXPECT_LT(summary->final_cost, 0.1 * summary->initial_cost);
  EXPECT_NEAR(summary->final_cost, cost_of(scene.graph), 1e-6 * summary->final_cost);
  EXPECT_LT(rms_m(scene.truth, scene.graph.nodes), 0.5 * before);
}

TEST(PoseGraph, ExactEdgesGiveTheExactPosesFromAFarStart) {
  PoseGraphScene scene = make_square_walk(40, 2, 0, 0, true);
  for (std::size_t n = 1; n < scene.graph.nodes.size(); ++n) {
    const double s = static_cast<double>(n);
    scene.graph.nodes[n].T_map_node =
        scene.truth[n].T_map_node *
        Se3::exp(0.2 *
                 (Vector6d() << std::sin(s), std::cos(2 * s), std::sin(3 * s), std::cos(4 * s), std::sin(5 * s), 1).finished());
  }
  const Result<PoseGraphSummary> summary = optimize_pose_graph(scene.graph, 100);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->converged);
  EXPECT_LT(rms_m(scene.truth, scene.graph.nodes), 1e-6);
}

TEST(PoseGraph, WhatIsConsistentDoesNotMove) {
  PoseGraphScene scene = make_square_walk(40, 1, 0, 0, true);
  const Result<PoseGraphSummary> summary = optimize_pose_graph(scene.graph, 20);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->converged);
  EXPECT_LT(summary->final_cost, 1e-12);
  EXPECT_LT(rms_m(scene.truth, scene.graph.nodes), 1e-9);
}

TEST(PoseGraph, FixedNodesStay) {
  PoseGraphScene scene = make_square_walk(40, 1, 0.005, 0.02, true);
  scene.graph.nodes[20].fixed = true;
  const PoseGraph before = scene.graph;
  ASSERT_TRUE(optimize_pose_graph(scene.graph, 20));
  for (const std::size_t n : {0u, 20u}) {
    EXPECT_EQ(before.nodes[n].T_map_node.translation(), scene.graph.nodes[n].T_map_node.translation());
    EXPECT_EQ(before.nodes[n].T_map_node.rotation().coeffs(), scene.graph.nodes[n].T_map_node.rotation().coeffs());
  }
  EXPECT_FALSE(same_bits(before, scene.graph));
}

TEST(PoseGraph, InformationDecidesWhoGivesWay) {
  // Two measurements of one pose contradict each other; the one with nine times the information gets nine tenths.
  PoseGraph graph;
  graph.nodes = {{Se3(), true}, {Se3(), false}};
  const auto edge = [](double x, double weight) {
    return PoseGraphEdge{0, 1, Se3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0)), weight * Matrix6d::Identity()};
  };
  graph.edges = {edge(1.0, 9.0), edge(2.0, 1.0)};
  ASSERT_TRUE(optimize_pose_graph(graph, 20));
  EXPECT_NEAR(graph.nodes[1].T_map_node.translation().x(), 1.1, 1e-6);
}

TEST(PoseGraph, AnInterruptAtAnyMomentLeavesAGraphThatIsNoWorse) {
  const PoseGraphScene scene = make_square_walk(80, 1, 0.02, 0.05, true);
  int asked = 0;
  PoseGraph whole = scene.graph;
  ASSERT_TRUE(optimize_pose_graph(whole, 20, [&asked] { return ++asked < 0; }));
  ASSERT_GT(asked, 2);
  const double initial_cost = cost_of(scene.graph);
  for (int moment = 0; moment < asked; ++moment) {
    PoseGraph graph = scene.graph;
    int left = moment;
    const Result<PoseGraphSummary> summary = optimize_pose_graph(graph, 20, [&left] { return left-- == 0; });
    ASSERT_TRUE(summary);
    EXPECT_FALSE(summary->converged) << moment;
    EXPECT_LE(cost_of(graph), initial_cost * (1 + 1e-12)) << moment;
    EXPECT_NEAR(cost_of(graph), summary->final_cost, 1e-9 * initial_cost) << moment;
  }
}

TEST(PoseGraph, GivesTheSameBits) {
  PoseGraph first = make_square_walk(60, 2, 0.01, 0.05, true).graph;
  PoseGraph second = first;
  const PoseGraph start = first;
  ASSERT_TRUE(optimize_pose_graph(first, 20));
  ASSERT_TRUE(optimize_pose_graph(second, 20));
  EXPECT_TRUE(same_bits(first, second));
  EXPECT_FALSE(same_bits(first, start));
}

TEST(PoseGraph, RefusesWhatItCannotSolve) {
  const PoseGraph good = make_square_walk(8, 1, 0.01, 0.05, true).graph;
  const auto refuses = [&good](auto spoil) {
    PoseGraph graph = good;
    spoil(graph);
    const Result<PoseGraphSummary> summary = optimize_pose_graph(graph, 20);
    return !summary && summary.error().code == ErrorCode::InvalidArgument && !summary.error().message.empty();
  };
  EXPECT_FALSE(refuses([](PoseGraph&) {}));
  EXPECT_TRUE(refuses([](PoseGraph& g) { g.nodes[0].fixed = false; }));
  EXPECT_TRUE(refuses([](PoseGraph& g) { g = PoseGraph(); }));
  EXPECT_TRUE(refuses([](PoseGraph& g) { g.edges[2].to = 8; }));
  EXPECT_TRUE(refuses([](PoseGraph& g) { g.edges[2].from = g.edges[2].to; }));
  EXPECT_TRUE(refuses([](PoseGraph& g) { g.edges[1].information(4, 4) = -1; }));
  EXPECT_TRUE(refuses([](PoseGraph& g) {
    g.nodes[3].T_map_node = Se3({1, 0, 0, 0}, Eigen::Vector3d(std::numeric_limits<double>::quiet_NaN(), 0, 0));
  }));
}

}  // namespace
}  // namespace posed
