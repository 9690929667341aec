#include "engine/base/numerics/sparse_cholesky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <thread>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "tests/engine/base/numerics/random_matrix.h"
#include "tests/support/dense.h"

namespace limber {
namespace {

using testing::random_matrix;
using Matrix = Eigen::SparseMatrix<double>;

// The 7-point Laplacian of a side^3 grid plus `shift`.
Matrix grid_matrix(int side, double shift) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto node = [side](int i, int j, int k) { return (k * side + j) * side + i; };
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const int a = node(i, j, k);
        entries.emplace_back(a, a, shift);
        const auto couple = [&](int b) {
          entries.emplace_back(a, a, 1);
          entries.emplace_back(b, b, 1);
          entries.emplace_back(a, b, -1);
          entries.emplace_back(b, a, -1);
        };
        if (i + 1 < side) couple(node(i + 1, j, k));
        if (j + 1 < side) couple(node(i, j + 1, k));
        if (k + 1 < side) couple(node(i, j, k + 1));
      }
    }
  }
  Matrix result(side * side * side, side * side * side);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

TEST(SparseCholesky, AgreesWithAnIndependentSolver) {
  const Matrix a = grid_matrix(9, 0.1);
  const Eigen::MatrixXd b = random_matrix(a.rows(), 5, 1);
  const Eigen::MatrixXd expected = reference::SparseLdlt(a).solve(b);
  const SparseCholesky cholesky(a);
  EXPECT_EQ(cholesky.size(), a.rows());
  EXPECT_GT(cholesky.factor_nonzeros(), static_cast<std::size_t>(a.rows()));
  EXPECT_LT((cholesky.solve(b) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT((a * cholesky.solve(b) - b).norm(), 1e-12 * b.norm());
}

TEST(SparseCholesky, LowerTriangleIsEnough) {
  const Matrix a = grid_matrix(6, 0.5);
  const Matrix lower = a.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd b = random_matrix(a.rows(), 1, 2);
  EXPECT_EQ(SparseCholesky(a).solve(b), SparseCholesky(lower).solve(b));
}

TEST(SparseCholesky, RefactorKeepsThePatternOnly) {
  Matrix a = grid_matrix(7, 1.0);
  SparseCholesky cholesky(a);
  a *= 3.0;
  a.coeffRef(5, 5) += 2;
  cholesky.refactor(a);
  const Eigen::MatrixXd b = random_matrix(a.rows(), 2, 3);
  EXPECT_LT((a * cholesky.solve(b) - b).norm(), 1e-12 * b.norm());
  Matrix other = a;
  other.coeffRef(40, 0) = 1e-3;
  other.coeffRef(0, 40) = 1e-3;
  other.makeCompressed();
  EXPECT_THROW(cholesky.refactor(other), Error);
  EXPECT_THROW(cholesky.refactor(grid_matrix(6, 1.0)), Error);
  EXPECT_THROW(SparseCholesky().refactor(a), Error);
  // A refused refactor leaves the old factor in place.
  EXPECT_LT((a * cholesky.solve(b) - b).norm(), 1e-12 * b.norm());
}

TEST(SparseCholesky, FactorInTwoHalvesGivesTheSameBits) {
  const Matrix a = grid_matrix(7, 0.3);
  const Eigen::MatrixXd b = random_matrix(a.rows(), 2, 4);
  SparseCholesky cholesky;
  cholesky.analyse(a);
  EXPECT_EQ(cholesky.size(), a.rows());
  EXPECT_FALSE(cholesky.factored());
  cholesky.refactor(a);
  EXPECT_TRUE(cholesky.factored());
  EXPECT_EQ(cholesky.solve(b), SparseCholesky(a).solve(b));
}

TEST(SparseCholesky, SolvesInTheCallersMemory) {
  const Matrix a = grid_matrix(6, 0.3);
  const SparseCholesky cholesky(a);
  const Eigen::MatrixXd b = random_matrix(a.rows() + 4, 40, 4);
  Eigen::MatrixXd strided = b;  // the block below has an outer stride larger than its rows
  cholesky.solve_in_place(strided.topRows(a.rows()));
  EXPECT_EQ(strided.bottomRows(4), b.bottomRows(4));
  EXPECT_LT((a * strided.topRows(a.rows()) - b.topRows(a.rows())).norm(), 1e-11 * b.norm());

  SparseCholesky::Workspace workspace;
  Eigen::VectorXd one = b.col(0).head(a.rows());
  cholesky.solve_in_place(one, workspace);
  EXPECT_LT((a * one - b.col(0).head(a.rows())).norm(), 1e-12 * b.norm());
  // A workspace fits other shapes and other factors.
  const Matrix small = grid_matrix(3, 1.0);
  Eigen::MatrixXd few = random_matrix(small.rows(), 3, 5);
  const Eigen::MatrixXd before = few;
  SparseCholesky(small).solve_in_place(few, workspace);
  EXPECT_LT((small * few - before).norm(), 1e-12 * before.norm());
}

TEST(SparseCholesky, RerunsAndThreadCountsGiveTheSameBits) {
  const Matrix a = grid_matrix(10, 0.01);
  const Eigen::MatrixXd b = random_matrix(a.rows(), 70, 6);
  const int threads = thread_count();
  set_thread_count(1);
  const Eigen::MatrixXd alone = SparseCholesky(a).solve(b);
  set_thread_count(5);
  const Eigen::MatrixXd together = SparseCholesky(a).solve(b);
  set_thread_count(threads);
  EXPECT_EQ(alone, together);
}

TEST(SparseCholesky, ConcurrentSolves) {
  const Matrix a = grid_matrix(8, 0.1);
  const SparseCholesky cholesky(a);
  const Eigen::MatrixXd b = random_matrix(a.rows(), 4, 7);
  Eigen::MatrixXd expected = b;
  SparseCholesky::Workspace workspace;
  for (int k = 0; k < 4; ++k) cholesky.solve_in_place(expected.col(k), workspace);
  std::vector<Eigen::VectorXd> results(4);
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      for (int repeat = 0; repeat < 50; ++repeat) {
        Eigen::VectorXd x = b.col(k);
        cholesky.solve_in_place(x);
        results[k] = x;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int k = 0; k < 4; ++k) EXPECT_EQ(results[k], expected.col(k));
}

TEST(SparseCholesky, NamesTheFailingPivot) {
  Matrix a = grid_matrix(5, 1.0);
  a.coeffRef(31, 31) = -100;
  SparseCholesky cholesky;
  try {
    cholesky.factor(a);
    FAIL() << "an indefinite matrix was factored";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNumerical);
    EXPECT_EQ(error.field(), "matrix[31]");
    EXPECT_THAT(error.what(), ::testing::HasSubstr("pivot of row 31"));
  }
  EXPECT_FALSE(cholesky.factored());
  // Mended values on the same pattern are accepted afterwards.
  a.coeffRef(31, 31) = 7;
  cholesky.refactor(a);
  EXPECT_TRUE(cholesky.factored());
}

TEST(SparseCholesky, SingularMatrixIsRefused) {
  // One exactly singular 2 x 2 block among sound ones.
  Matrix a(4, 4);
  a.insert(0, 0) = 2;
  a.insert(1, 1) = 4;
  a.insert(2, 2) = 9;
  a.insert(3, 3) = 1;
  a.insert(2, 1) = 6;
  a.insert(1, 2) = 6;
  a.makeCompressed();
  EXPECT_THROW(SparseCholesky{a}, Error);
}

TEST(SparseCholesky, RefusesBadInput) {
  Matrix a = grid_matrix(3, 1.0);
  a.coeffRef(4, 4) = std::numeric_limits<double>::quiet_NaN();
  try {
    SparseCholesky{a};
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("(4, 4)"));
  }
  EXPECT_THROW(SparseCholesky{Matrix(3, 4)}, Error);
  EXPECT_THROW(SparseCholesky{Matrix(0, 0)}, Error);
}

}  // namespace
}  // namespace limber
