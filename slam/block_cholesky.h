#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/se3.h"
#include "slam/interrupt.h"

namespace posed {

/// Which 6x6 blocks of a symmetric matrix's lower triangle are not zero, column by column.
struct BlockPattern {
  std::vector<std::uint32_t> offsets;  ///< of each column's first block in `rows`, and the end: columns + 1 numbers
  std::vector<std::uint32_t> rows;     ///< a column's own diagonal block first, then the others; ascending

  std::size_t columns() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

/// L L^T of a symmetric positive definite matrix of 6x6 blocks, sparse in whole blocks; left-looking (Davis, "Direct methods for
/// sparse linear systems", 2006, chapter 4). The caller chooses the order of elimination. Keeps its memory. Thread-bound.
class BlockCholesky {
 public:
  enum class Outcome { Factorized, NotPositiveDefinite, Interrupted };

  /// Finds the pattern of L. The pattern must outlive the calls of `factorize`.
  void analyze(const BlockPattern& pattern);

  /// `values` are the blocks of the analysed pattern in its order; of a diagonal block the lower triangle is read.
  Outcome factorize(const std::vector<Matrix6d>& values, const Interrupt& interrupt = {});

  /// Right-hand side in, solution out, with the last factor.
  void solve_in_place(Eigen::VectorXd& x) const;

  std::size_t factor_blocks() const { return factor_pattern_.rows.size(); }

 private:
  void find_factor_pattern();
  bool finish_column(std::uint32_t column);

  /// A block of L in the row of the block that it updates, and where its column ends.
  struct RowEntry {
    std::uint32_t position, column_end;
  };

  const BlockPattern* pattern_ = nullptr;
  BlockPattern factor_pattern_;
  std::vector<std::uint32_t> row_offsets_;
  std::vector<RowEntry> row_entries_;  // strictly left of the diagonal
  std::vector<Matrix6d> factor_;
  std::vector<Matrix6d> inverse_diagonal_;
  std::vector<std::uint32_t> slot_;  // scratch: of a row in the present column
};

}  // namespace posed
