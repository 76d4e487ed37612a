#include "slam/elimination_order.h"

#include <numeric>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace posed {

std::vector<std::uint32_t> elimination_order(const BlockPattern& pattern) {
  const std::size_t columns = pattern.columns();
  std::vector<std::uint32_t> order(columns);
  std::iota(order.begin(), order.end(), 0u);
  if (pattern.rows.size() == columns * (columns + 1) / 2) {
    return order;  // every order is as good where every block is there
  }
  const auto size = static_cast<int>(columns);
  Eigen::SparseMatrix<double> graph(size, size);
  graph.reserve(static_cast<Eigen::Index>(pattern.rows.size()));
  for (std::size_t j = 0; j < columns; ++j) {
    graph.startVec(static_cast<int>(j));
    for (std::uint32_t q = pattern.offsets[j]; q < pattern.offsets[j + 1]; ++q) {
      graph.insertBack(static_cast<int>(pattern.rows[q]), static_cast<int>(j)) = 1.0;
    }
  }
  graph.finalize();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> eliminated;
  Eigen::AMDOrdering<int>()(graph, eliminated);
  for (std::size_t n = 0; n < columns; ++n) {
    order[n] = static_cast<std::uint32_t>(eliminated.indices()[static_cast<Eigen::Index>(n)]);
  }
  return order;
}

}  // namespace posed
