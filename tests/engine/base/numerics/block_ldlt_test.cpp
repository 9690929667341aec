#include "engine/base/numerics/block_ldlt.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numeric>
#include <set>

#include "engine/base/numerics/fill_ordering.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "tests/support/dense.h"

namespace limber {
namespace {

using Edges = std::vector<std::pair<int, int>>;
using Block = Eigen::Matrix<double, 9, 9>;

Edges grid(int columns, int rows) {
  Edges edges;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int v = r * columns + c;
      if (c + 1 < columns) edges.emplace_back(v + 1, v);
      if (r + 1 < rows) edges.emplace_back(v, v + columns);
    }
  }
  return edges;
}

Block random_block(Random& random) {
  Block block;
  for (int i = 0; i < 81; ++i) block.data()[i] = random.uniform(-1, 1);
  return block;
}

/// Random values with `diagonal` added on the diagonal; the same as a dense matrix.
Eigen::MatrixXd fill(BlockLdlt& factor, const Edges& edges, double diagonal, Random& random) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(factor.size(), factor.size());
  for (int n = 0; n < factor.nodes(); ++n) {
    const Block half = random_block(random);
    const Block block = half + half.transpose() + diagonal * Block::Identity();
    dense.block<9, 9>(9 * n, 9 * n) = block;
    // The upper triangle is not read.
    Eigen::Map<Block>(factor.diagonal(n)).setConstant(std::nan(""));
    Eigen::Map<Block>(factor.diagonal(n)).triangularView<Eigen::Lower>() = block;
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges[e];
    const Block block = random_block(random);
    Eigen::Map<Block>(factor.coupling(static_cast<int>(e))) = block;
    dense.block<9, 9>(9 * a, 9 * b) += block;
    dense.block<9, 9>(9 * b, 9 * a) += block.transpose();
  }
  return dense;
}

PivotCount signs_of(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd values = reference::symmetric_eigenvalues(matrix);
  PivotCount count;
  for (const double value : values) ++(value > 0 ? count.positive : count.negative);
  return count;
}

void expect_factors(int nodes, const Edges& edges, double diagonal) {
  Random random(static_cast<std::uint64_t>(nodes));
  BlockLdlt factor(nodes, edges);
  for (int round = 0; round < 2; ++round) {  // the second time over used memory
    const Eigen::MatrixXd dense = fill(factor, edges, diagonal, random);
    EXPECT_EQ(factor.factor(), signs_of(dense));
    Eigen::VectorXd right =
        Eigen::VectorXd::NullaryExpr(dense.rows(), [&] { return random.normal(); });
    Eigen::VectorXd x = right;
    factor.solve_in_place(x.data());
    EXPECT_LT((dense * x - right).norm(), 1e-9 * right.norm() * (1 + x.norm()));
  }
}

TEST(BlockLdlt, AgreesWithDenseOnManyGraphs) {
  expect_factors(1, {}, 30);
  expect_factors(3, {}, 30);                        // no edges: several roots
  expect_factors(4, {{0, 1}, {2, 1}, {3, 1}}, 40);  // a star
  expect_factors(5, {{0, 1}, {1, 0}, {2, 3}}, 40);  // a repeated edge, parts
  for (const auto& [c, r] : Edges{{2, 2}, {3, 5}, {7, 7}, {12, 9}})
    expect_factors(c * r, grid(c, r), 45);
}

TEST(BlockLdlt, IndefiniteMatricesGiveTheirInertia) {
  expect_factors(49, grid(7, 7), 0);
  expect_factors(108, grid(12, 9), 3);
  expect_factors(20, grid(20, 1), -2);
}

TEST(BlockLdlt, ResultsDoNotDependOnThreads) {
  const Edges edges = grid(13, 11);
  const int before = thread_count();
  std::vector<Eigen::VectorXd> answers;
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    Random random(7);
    BlockLdlt factor(143, edges);
    (void)fill(factor, edges, 45, random);
    (void)factor.factor();
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(factor.size(), -1, 1);
    factor.solve_in_place(x.data());
    answers.push_back(x);
  }
  set_thread_count(before);
  EXPECT_EQ(answers[0], answers[1]);
  EXPECT_EQ(answers[0], answers[2]);
}

TEST(BlockLdlt, SingularMatricesAreDetected) {
  BlockLdlt factor(4, grid(2, 2));
  Random random(3);
  (void)fill(factor, grid(2, 2), 40, random);
  for (const int node : {0, 1, 2, 3}) Eigen::Map<Block>(factor.diagonal(node)).setIdentity();
  for (const int edge : {0, 1, 2, 3}) Eigen::Map<Block>(factor.coupling(edge)).setZero();
  factor.diagonal(2)[10 * 4] = 0;
  const PivotCount count = factor.factor();
  EXPECT_EQ(count.vanishing, 1);
  EXPECT_EQ(count.positive, 35);
  EXPECT_FALSE(count.positive_definite());
}

TEST(FillOrdering, IsAPermutationThatKeepsFillSmall) {
  const Edges edges = grid(20, 20);
  for (const FillOrdering method :
       {FillOrdering::kMinimumDegree, FillOrdering::kNestedDissection}) {
    const std::vector<int> order = fill_reducing_order(400, edges, method);
    EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(), 400u);
    EXPECT_EQ(order, fill_reducing_order(400, edges, method));
  }
  // In the natural order the factor of a 20 x 20 grid holds about 400 * 20 blocks.
  EXPECT_LT(BlockLdlt(400, edges).factor_entries() / 81, 5000u);
}

}  // namespace
}  // namespace limber
