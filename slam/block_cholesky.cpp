#include "slam/block_cholesky.h"

#include <algorithm>
#include <limits>

#include <Eigen/Cholesky>

namespace posed {

void BlockCholesky::analyze(const BlockPattern& pattern) {
  pattern_ = &pattern;
  find_factor_pattern();

  const std::size_t columns = pattern.columns();
  const std::vector<std::uint32_t>& offsets = factor_pattern_.offsets;
  const std::vector<std::uint32_t>& rows = factor_pattern_.rows;
  row_offsets_.assign(columns + 1, 0);
  for (std::size_t k = 0; k < columns; ++k) {
    for (std::uint32_t q = offsets[k] + 1; q < offsets[k + 1]; ++q) {
      ++row_offsets_[rows[q] + 1];
    }
  }
  for (std::size_t i = 0; i < columns; ++i) {
    row_offsets_[i + 1] += row_offsets_[i];
  }
  row_entries_.resize(row_offsets_[columns]);
  slot_.assign(row_offsets_.begin(), row_offsets_.end() - 1);
  for (std::size_t k = 0; k < columns; ++k) {
    for (std::uint32_t q = offsets[k] + 1; q < offsets[k + 1]; ++q) {
      row_entries_[slot_[rows[q]]++] = {q, offsets[k + 1]};
    }
  }
  factor_.resize(rows.size());
  inverse_diagonal_.resize(columns);
}

/// A column of L has the rows of the matrix's column and those of its children in the elimination tree, the columns whose first
/// row below the diagonal it is.
void BlockCholesky::find_factor_pattern() {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  const auto columns = static_cast<std::uint32_t>(pattern_->columns());
  std::vector<std::uint32_t>& offsets = factor_pattern_.offsets;
  std::vector<std::uint32_t>& rows = factor_pattern_.rows;
  offsets.assign(1, 0);
  rows.clear();
  std::vector<std::uint32_t> first_child(columns, kNone);
  std::vector<std::uint32_t> next_sibling(columns, kNone);
  slot_.assign(columns, kNone);  // the column in which a row was last entered
  const auto enter = [&](std::uint32_t row, std::uint32_t column) {
    if (slot_[row] != column) {
      slot_[row] = column;
      rows.push_back(row);
    }
  };
  for (std::uint32_t j = 0; j < columns; ++j) {
    enter(j, j);
    for (std::uint32_t q = pattern_->offsets[j]; q < pattern_->offsets[j + 1]; ++q) {
      enter(pattern_->rows[q], j);
    }
    for (std::uint32_t child = first_child[j]; child != kNone; child = next_sibling[child]) {
      for (std::uint32_t q = offsets[child] + 1; q < offsets[child + 1]; ++q) {
        enter(rows[q], j);
      }
    }
    std::sort(rows.begin() + offsets[j], rows.end());
    offsets.push_back(static_cast<std::uint32_t>(rows.size()));
    if (offsets[j + 1] > offsets[j] + 1) {
      const std::uint32_t parent = rows[offsets[j] + 1];
      next_sibling[j] = first_child[parent];
      first_child[parent] = j;
    }
  }
}

BlockCholesky::Outcome BlockCholesky::factorize(const std::vector<Matrix6d>& values, const Interrupt& interrupt) {
  const std::vector<std::uint32_t>& offsets = factor_pattern_.offsets;
  const std::vector<std::uint32_t>& rows = factor_pattern_.rows;
  const auto columns = static_cast<std::uint32_t>(pattern_->columns());
  for (std::uint32_t j = 0; j < columns; ++j) {
    if (is_interrupted(interrupt)) {
      return Outcome::Interrupted;
    }
    for (std::uint32_t q = offsets[j]; q < offsets[j + 1]; ++q) {
      slot_[rows[q]] = q;
      factor_[q].setZero();
    }
    for (std::uint32_t q = pattern_->offsets[j]; q < pattern_->offsets[j + 1]; ++q) {
      factor_[slot_[pattern_->rows[q]]] = values[q];
    }
    for (std::uint32_t e = row_offsets_[j]; e < row_offsets_[j + 1]; ++e) {
      const RowEntry& entry = row_entries_[e];
      const Matrix6d transposed = factor_[entry.position].transpose();
      for (std::uint32_t q = entry.position; q < entry.column_end; ++q) {
        factor_[slot_[rows[q]]].noalias() -= factor_[q] * transposed;
      }
    }
    if (!finish_column(j)) {
      return Outcome::NotPositiveDefinite;
    }
  }
  return Outcome::Factorized;
}

bool BlockCholesky::finish_column(std::uint32_t column) {
  const std::uint32_t begin = factor_pattern_.offsets[column];
  const Eigen::LLT<Matrix6d> diagonal(factor_[begin]);
  if (diagonal.info() != Eigen::Success) {
    return false;
  }
  Matrix6d inverse = Matrix6d::Identity();
  diagonal.matrixL().solveInPlace(inverse);
  if (!inverse.allFinite()) {
    return false;
  }
  inverse_diagonal_[column] = inverse;
  const Matrix6d transposed = inverse.transpose();
  for (std::uint32_t q = begin + 1; q < factor_pattern_.offsets[column + 1]; ++q) {
    factor_[q] = factor_[q] * transposed;
  }
  return true;
}

void BlockCholesky::solve_in_place(Eigen::VectorXd& x) const {
  const std::vector<std::uint32_t>& offsets = factor_pattern_.offsets;
  const std::vector<std::uint32_t>& rows = factor_pattern_.rows;
  const std::size_t columns = inverse_diagonal_.size();
  const auto segment = [&x](std::size_t block) { return x.segment<6>(static_cast<Eigen::Index>(6 * block)); };
  for (std::size_t j = 0; j < columns; ++j) {
    const Vector6d xj = inverse_diagonal_[j] * segment(j);
    segment(j) = xj;
    for (std::uint32_t q = offsets[j] + 1; q < offsets[j + 1]; ++q) {
      segment(rows[q]).noalias() -= factor_[q] * xj;
    }
  }
  for (std::size_t j = columns; j-- > 0;) {
    Vector6d xj = segment(j);
    for (std::uint32_t q = offsets[j] + 1; q < offsets[j + 1]; ++q) {
      xj.noalias() -= factor_[q].transpose() * segment(rows[q]);
    }
    segment(j).noalias() = inverse_diagonal_[j].transpose() * xj;
  }
}

}  // namespace posed
