#include "engine/base/numerics/multifrontal_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/random.h"
#include "tests/support/dense.h"

namespace limber::detail {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

struct Named {
  std::string name;
  Matrix a;
};

Matrix from(int size, const std::vector<std::pair<int, int>>& edges, int copies) {
  Random random(7);
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < size * copies; ++k) entries.emplace_back(k, k, 0.1);
  for (const auto& [a, b] : edges) {
    // g g^T over all coordinates of both: symmetric, positive semidefinite, dense blocks.
    for (int repeat = 0; repeat < copies; ++repeat) {
      Eigen::VectorXd g(2 * copies);
      for (double& entry : g) entry = random.normal();
      const auto index = [&, a = a, b = b](int k) {
        return k < copies ? a * copies + k : b * copies + k - copies;
      };
      for (int r = 0; r < 2 * copies; ++r) {
        for (int c = 0; c < 2 * copies; ++c) entries.emplace_back(index(r), index(c), g[r] * g[c]);
      }
    }
  }
  Matrix result(size * copies, size * copies);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

std::vector<Named> matrices() {
  std::vector<Named> result;
  std::vector<std::pair<int, int>> chain, star, grid, random_graph, full;
  for (int k = 0; k < 199; ++k) chain.emplace_back(k, k + 1);
  for (int k = 1; k < 60; ++k) star.emplace_back(0, k);
  for (int j = 0; j < 23; ++j) {
    for (int i = 0; i < 23; ++i) {
      if (i > 0) grid.emplace_back(23 * j + i, 23 * j + i - 1);
      if (j > 0) grid.emplace_back(23 * j + i, 23 * j + i - 23);
    }
  }
  Random random(3);
  for (int k = 0; k < 500; ++k) {
    const int a = static_cast<int>(random.uniform() * 200),
              b = static_cast<int>(random.uniform() * 200);
    if (a != b) random_graph.emplace_back(a, b);
  }
  for (int a = 0; a < 90; ++a) {
    for (int b = 0; b < a; ++b) full.emplace_back(a, b);
  }
  result.push_back({"OneByOne", from(1, {}, 1)});
  result.push_back({"Diagonal", from(40, {}, 1)});
  result.push_back({"Chain", from(200, chain, 1)});
  result.push_back({"ChainOfThrees", from(200, chain, 3)});
  result.push_back({"Star", from(60, star, 2)});
  result.push_back({"GridOfThrees", from(23 * 23, grid, 3)});
  result.push_back({"RandomGraphWithLooseNodes", from(200, random_graph, 1)});
  result.push_back({"Full", from(90, full, 1)});
  return result;
}

class MultifrontalCholeskyOf : public ::testing::TestWithParam<Named> {};

TEST_P(MultifrontalCholeskyOf, SolvesAsAnIndependentSolver) {
  const Matrix& a = GetParam().a;
  MultifrontalCholesky cholesky;
  cholesky.analyse(a);
  ASSERT_FALSE(cholesky.factor(a).has_value());
  EXPECT_EQ(cholesky.size(), a.rows());
  Random random(1);
  Eigen::MatrixXd b(a.rows(), 5);
  for (double& entry : b.reshaped()) entry = random.normal();
  const Eigen::MatrixXd expected = reference::SparseLdlt(a).solve(b);
  MultifrontalCholesky::Workspace workspace;
  Eigen::MatrixXd x = b;
  cholesky.solve_in_place(x.data(), x.cols(), x.rows(), workspace);
  EXPECT_LT((a * x - b).norm(), 1e-11 * b.norm());
  EXPECT_LT((x - expected).norm(), 1e-9 * expected.norm());
}

TEST_P(MultifrontalCholeskyOf, TheLowerHalfIsEnoughAndOtherValuesUseTheSameLayout) {
  const Matrix& a = GetParam().a;
  Matrix lower = a.triangularView<Eigen::Lower>();
  MultifrontalCholesky cholesky;
  cholesky.analyse(lower);
  lower *= 4.0;
  ASSERT_FALSE(cholesky.factor(lower).has_value());
  Eigen::VectorXd x = Eigen::VectorXd::Ones(a.rows());
  MultifrontalCholesky::Workspace workspace;
  cholesky.solve_in_place(x.data(), 1, x.rows(), workspace);
  EXPECT_LT((4 * (a * x) - Eigen::VectorXd::Ones(a.rows())).norm(), 1e-11 * x.size());
}

TEST_P(MultifrontalCholeskyOf, AnIndefiniteMatrixHasAFailedPivotAndCanBeCorrected) {
  Matrix a = GetParam().a;
  const int row = static_cast<int>(a.rows()) / 2;
  const double kept = a.coeff(row, row);
  MultifrontalCholesky cholesky;
  cholesky.analyse(a);
  a.coeffRef(row, row) = -1e-3;
  const auto failed = cholesky.factor(a);
  ASSERT_TRUE(failed.has_value());
  EXPECT_LE(failed->value, 0);
  a.coeffRef(row, row) = kept;
  EXPECT_FALSE(cholesky.factor(a).has_value());
}

INSTANTIATE_TEST_SUITE_P(Matrices, MultifrontalCholeskyOf, ::testing::ValuesIn(matrices()),
                         [](const auto& named) { return named.param.name; });

}  // namespace
}  // namespace limber::detail
