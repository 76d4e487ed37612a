#include "slam/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "slam/block_cholesky.h"
#include "slam/elimination_order.h"
#include "slam/marquardt_damping.h"
#include "slam/pose_graph_edge.h"

namespace posed {

namespace {

// A step that lowers the cost, a chi-squared, by less than this share of it ends the optimisation; a share of 1 where it is
// smaller.
constexpr double kCostTolerance = 1e-9;
constexpr std::size_t kEdgesBetweenInterrupts = 256;
constexpr std::uint32_t kFixed = std::numeric_limits<std::uint32_t>::max();

bool is_pause(std::size_t edge, const Interrupt& interrupt) {
  return edge % kEdgesBetweenInterrupts == 0 && is_interrupted(interrupt);
}

class Minimiser {
 public:
  Minimiser(PoseGraph& graph, const Interrupt& interrupt);

  PoseGraphSummary run(int max_iterations);

 private:
  void find_pattern();
  void order_for_elimination();
  std::uint32_t block_of(std::uint32_t column, std::uint32_t row) const;
  std::optional<double> cost_at(const std::vector<PoseGraphNode>& nodes, const Interrupt& interrupt) const;
  bool linearise();
  void add_edge(const PoseGraphEdge& edge);
  BlockCholesky::Outcome solve(double damping);
  void apply_step();

  PoseGraph& graph_;
  const Interrupt& interrupt_;
  std::vector<std::uint32_t> unknown_of_node_;
  std::vector<std::uint32_t> unknowns_;  // their nodes, in the order of elimination
  BlockPattern pattern_;
  std::vector<Matrix6d> hessian_;
  std::vector<Matrix6d> damped_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
  double predicted_decrease_ = 0;
  BlockCholesky cholesky_;
  std::vector<PoseGraphNode> candidate_;
};

Minimiser::Minimiser(PoseGraph& graph, const Interrupt& interrupt)
    : graph_(graph), interrupt_(interrupt), unknown_of_node_(graph.nodes.size(), kFixed) {
  for (std::uint32_t n = 0; n < graph.nodes.size(); ++n) {
    if (!graph.nodes[n].fixed) {
      unknown_of_node_[n] = static_cast<std::uint32_t>(unknowns_.size());
      unknowns_.push_back(n);
    }
  }
  find_pattern();
  order_for_elimination();
  cholesky_.analyze(pattern_);
  hessian_.resize(pattern_.rows.size());
  gradient_.resize(static_cast<Eigen::Index>(6 * unknowns_.size()));
}

void Minimiser::find_pattern() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> blocks;  // column, row
  for (std::uint32_t i = 0; i < unknowns_.size(); ++i) {
    blocks.emplace_back(i, i);
  }
  for (const PoseGraphEdge& edge : graph_.edges) {
    const auto [column, row] = std::minmax(unknown_of_node_[edge.from], unknown_of_node_[edge.to]);
    if (row != kFixed) {
      blocks.emplace_back(column, row);
    }
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  pattern_.offsets.assign(unknowns_.size() + 1, 0);
  pattern_.rows.clear();
  for (const auto& [column, row] : blocks) {
    pattern_.rows.push_back(row);
    pattern_.offsets[column + 1] = static_cast<std::uint32_t>(pattern_.rows.size());
  }
}

void Minimiser::order_for_elimination() {
  const std::vector<std::uint32_t> unordered = unknowns_;
  const std::vector<std::uint32_t> order = elimination_order(pattern_);
  for (std::uint32_t n = 0; n < order.size(); ++n) {
    unknowns_[n] = unordered[order[n]];
    unknown_of_node_[unknowns_[n]] = n;
  }
  find_pattern();
}

std::uint32_t Minimiser::block_of(std::uint32_t column, std::uint32_t row) const {
  const auto begin = pattern_.rows.begin() + pattern_.offsets[column];
  const auto end = pattern_.rows.begin() + pattern_.offsets[column + 1];
  return static_cast<std::uint32_t>(std::lower_bound(begin, end, row) - pattern_.rows.begin());
}

/// Nothing: interrupted.
std::optional<double> Minimiser::cost_at(const std::vector<PoseGraphNode>& nodes, const Interrupt& interrupt) const {
  double cost = 0;
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    if (is_pause(e, interrupt)) {
      return std::nullopt;
    }
    const PoseGraphEdge& edge = graph_.edges[e];
    const Vector6d xi = pose_graph::edge_residual(nodes[edge.from].T_map_node, nodes[edge.to].T_map_node, edge.T_from_to);
    cost += xi.dot(edge.information * xi);
  }
  return cost;
}

/// False: interrupted.
bool Minimiser::linearise() {
  for (Matrix6d& block : hessian_) {
    block.setZero();
  }
  gradient_.setZero();
  for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
    if (is_pause(e, interrupt_)) {
      return false;
    }
    add_edge(graph_.edges[e]);
  }
  return true;
}

void Minimiser::add_edge(const PoseGraphEdge& edge) {
  const pose_graph::EdgeTerms t =
      pose_graph::linearise_edge(graph_.nodes[edge.from].T_map_node, graph_.nodes[edge.to].T_map_node, edge.T_from_to);
  const std::uint32_t from = unknown_of_node_[edge.from];
  const std::uint32_t to = unknown_of_node_[edge.to];
  const Matrix6d weighted_from = edge.information * t.by_from;
  const Matrix6d weighted_to = edge.information * t.by_to;
  if (from != kFixed) {
    hessian_[pattern_.offsets[from]] += t.by_from.transpose() * weighted_from;
    gradient_.segment<6>(static_cast<Eigen::Index>(6 * from)) -= weighted_from.transpose() * t.xi;
  }
  if (to != kFixed) {
    hessian_[pattern_.offsets[to]] += t.by_to.transpose() * weighted_to;
    gradient_.segment<6>(static_cast<Eigen::Index>(6 * to)) -= weighted_to.transpose() * t.xi;
  }
  if (from != kFixed && to != kFixed) {
    hessian_[block_of(std::min(from, to), std::max(from, to))] +=
        from < to ? Matrix6d(t.by_to.transpose() * weighted_from) : Matrix6d(t.by_from.transpose() * weighted_to);
  }
}

BlockCholesky::Outcome Minimiser::solve(double damping) {
  damped_ = hessian_;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    damped_[pattern_.offsets[i]].diagonal() += MarquardtDamping::terms(hessian_[pattern_.offsets[i]], damping);
  }
  const BlockCholesky::Outcome outcome = cholesky_.factorize(damped_, interrupt_);
  if (outcome != BlockCholesky::Outcome::Factorized) {
    return outcome;
  }
  step_ = gradient_;
  cholesky_.solve_in_place(step_);
  predicted_decrease_ = step_.dot(gradient_);
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const Vector6d xi = step_.segment<6>(static_cast<Eigen::Index>(6 * i));
    predicted_decrease_ += xi.dot(MarquardtDamping::terms(hessian_[pattern_.offsets[i]], damping).cwiseProduct(xi));
  }
  return std::isfinite(predicted_decrease_) ? outcome : BlockCholesky::Outcome::NotPositiveDefinite;
}

void Minimiser::apply_step() {
  candidate_ = graph_.nodes;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    Se3& pose = candidate_[unknowns_[i]].T_map_node;
    pose = pose * Se3::exp(step_.segment<6>(static_cast<Eigen::Index>(6 * i)));
  }
}

PoseGraphSummary Minimiser::run(int max_iterations) {
  PoseGraphSummary summary;
  summary.initial_cost = summary.final_cost = cost_at(graph_.nodes, {}).value();
  MarquardtDamping damping;
  bool is_linearised = false;
  while (summary.iterations < max_iterations) {
    if (!is_linearised && !linearise()) {
      return summary;
    }
    is_linearised = true;
    ++summary.iterations;
    const BlockCholesky::Outcome outcome = solve(damping.value());
    if (outcome == BlockCholesky::Outcome::Interrupted) {
      return summary;
    }
    if (outcome == BlockCholesky::Outcome::NotPositiveDefinite) {
      damping.refused();
      if (damping.is_exhausted()) {
        return summary;
      }
      continue;
    }
    apply_step();
    const std::optional<double> cost = cost_at(candidate_, interrupt_);
    if (!cost) {
      return summary;
    }
    const double decrease = summary.final_cost - *cost;
    const double negligible = kCostTolerance * std::max(1.0, summary.final_cost);
    summary.converged = (decrease > 0 ? decrease : predicted_decrease_) <= negligible;
    if (decrease > 0) {
      graph_.nodes = candidate_;
      summary.final_cost = *cost;
      is_linearised = false;
      damping.accepted(decrease / predicted_decrease_);
    } else {
      damping.refused();
    }
    if (summary.converged || damping.is_exhausted()) {
      return summary;
    }
  }
  return summary;
}

}  // namespace

Result<PoseGraphSummary> optimize_pose_graph(PoseGraph& graph, int max_iterations, const Interrupt& interrupt) {
  if (const Status status = pose_graph::check(graph); !status) {
    return tl::unexpected(status.error());
  }
  return Minimiser(graph, interrupt).run(max_iterations);
}

}  // namespace posed
