#include "slam/block_cholesky.h"

#include <algorithm>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace posed {
namespace {

/// A random symmetric positive definite matrix with a random pattern, as blocks and whole.
struct RandomSystem {
  BlockPattern pattern;
  std::vector<Matrix6d> values;
  Eigen::MatrixXd whole;

  RandomSystem(unsigned seed, std::uint32_t columns, double filled) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform;
    whole.setZero(6 * columns, 6 * columns);
    pattern.offsets.push_back(0);
    for (std::uint32_t j = 0; j < columns; ++j) {
      for (std::uint32_t i = j; i < columns; ++i) {
        if (i != j && uniform(generator) > filled) {
          continue;
        }
        Matrix6d block = Matrix6d::NullaryExpr([&] { return uniform(generator) - 0.5; });
        if (i == j) {
          block = (block + block.transpose()).eval();
          block.diagonal().array() += 6.0 * (1.0 + filled * columns);
        }
        pattern.rows.push_back(i);
        values.push_back(block);
        whole.block<6, 6>(6 * i, 6 * j) = block;
        whole.block<6, 6>(6 * j, 6 * i) = block.transpose();
      }
      pattern.offsets.push_back(static_cast<std::uint32_t>(pattern.rows.size()));
    }
  }
};

TEST(BlockCholesky, SolvesWhatADenseFactorSolves) {
  BlockCholesky cholesky;  // one for all: it is to forget the last pattern
  for (unsigned seed = 0; seed < 30; ++seed) {
    const RandomSystem system(seed, 1 + seed, seed % 3 == 0 ? 1.0 : 0.1);
    cholesky.analyze(system.pattern);
    ASSERT_EQ(cholesky.factorize(system.values), BlockCholesky::Outcome::Factorized);
    const Eigen::VectorXd right_side = Eigen::VectorXd::LinSpaced(system.whole.rows(), -1, 2);
    Eigen::VectorXd x = right_side;
    cholesky.solve_in_place(x);
    EXPECT_LT((x - system.whole.llt().solve(right_side)).norm(), 1e-12) << seed;
  }
}

TEST(BlockCholesky, FillsInOnlyWhereEliminationDoes) {
  // A chain has no fill-in, in its own order; an arrow that is eliminated from its head fills in wholly.
  BlockPattern chain{{0, 2, 4, 6, 7}, {0, 1, 1, 2, 2, 3, 3}};
  BlockPattern arrow{{0, 4, 5, 6, 7}, {0, 1, 2, 3, 1, 2, 3}};
  BlockCholesky cholesky;
  cholesky.analyze(chain);
  EXPECT_EQ(cholesky.factor_blocks(), 7u);
  cholesky.analyze(arrow);
  EXPECT_EQ(cholesky.factor_blocks(), 10u);
}

TEST(BlockCholesky, SaysWhereTheMatrixIsNotPositiveDefinite) {
  RandomSystem system(3, 8, 0.3);
  system.values.back()(5, 5) = -1.0;
  BlockCholesky cholesky;
  cholesky.analyze(system.pattern);
  EXPECT_EQ(cholesky.factorize(system.values), BlockCholesky::Outcome::NotPositiveDefinite);
}

TEST(BlockCholesky, GivesUpWhenAsked) {
  const RandomSystem system(4, 8, 0.3);
  BlockCholesky cholesky;
  cholesky.analyze(system.pattern);
  int left = 5;
  EXPECT_EQ(cholesky.factorize(system.values, [&left] { return --left == 0; }), BlockCholesky::Outcome::Interrupted);
}

}  // namespace
}  // namespace posed
