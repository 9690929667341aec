#include "engine/rods/solver/bordered_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/error.h"
#include "tests/engine/rods/solver/random_linkage.h"
#include "tests/support/dense.h"

namespace limber::rods {
namespace {

using testing::fill_randomly;

class BorderedSolverTest : public ::testing::Test {
 protected:
  BorderedSolverTest() {
    std::vector<Chain> list;
    for (int j = 0; j + 1 < 9; ++j) {
      list.push_back({6, j, j + 1});
      if (j % 3 == 0) list.push_back({4, j, -1});
    }
    structure_ = std::make_shared<const ChainBatches>(list, 9);
    rows_ = Eigen::MatrixXd::Zero(3, structure_->size());
    for (int j = 0; j < 9; ++j) rows_(0, structure_->joint_begin(j) + 6) = 1.0 / 9;  // mean angle
    rows_(1, structure_->joint_begin(3) + 6) = 1;                                    // single ones
    rows_(2, structure_->joint_begin(7) + 6) = 1;
  }

  Eigen::MatrixXd whole(const Eigen::MatrixXd& h, const Eigen::VectorXd& compliance) const {
    const Eigen::Index n = h.rows();
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(n + 3, n + 3);
    result.topLeftCorner(n, n) = h;
    result.bottomLeftCorner(3, n) = rows_;
    result.topRightCorner(n, 3) = rows_.transpose();
    result.bottomRightCorner(3, 3).diagonal() = -compliance;
    return result;
  }

  /// Negative eigenvalues on the directions that keep the rows.
  int negative_on_constraints(const Eigen::MatrixXd& h) const {
    const Eigen::MatrixXd q = reference::kernel(rows_);
    return reference::negative_eigenvalues(q.transpose() * h * q);
  }

  std::shared_ptr<const ChainBatches> structure_;
  Eigen::MatrixXd rows_;
};

TEST_F(BorderedSolverTest, SolvesConstraintsAndSprings) {
  Random random(1);
  CondensedMatrix matrix(structure_);
  CondensedSolver solver(structure_);
  for (const double compliance : {0.0, 1e-9, 0.3}) {
    fill_randomly(matrix, compliance == 0.3 ? 0.2 : 0, random);
    const Eigen::MatrixXd h = matrix.to_sparse();
    (void)solver.factor(matrix);
    const Eigen::VectorXd c = Eigen::VectorXd::Constant(3, compliance);
    const BorderedSolver bordered(solver, rows_, c);
    Eigen::VectorXd right =
        Eigen::VectorXd::NullaryExpr(h.rows() + 3, [&] { return random.normal(); });
    Eigen::VectorXd x = right.head(h.rows());
    Eigen::VectorXd y = right.tail(3);
    bordered.solve_in_place(x, y);
    const Eigen::VectorXd expected = reference::ThinQr(whole(h, c)).least_squares(right);
    EXPECT_LT((x - expected.head(h.rows())).norm(), 1e-7 * expected.norm());
    EXPECT_LT((y - expected.tail(3)).norm(), 1e-7 * expected.norm());
    if (compliance == 0) {
      EXPECT_LT((rows_ * x - right.tail(3)).norm(), 1e-12 * (1 + x.norm()));
    }
  }
}

TEST_F(BorderedSolverTest, CountsInstabilitiesThatTheRowsLeave) {
  Random random(2);
  CondensedMatrix matrix(structure_);
  CondensedSolver solver(structure_);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3);
  for (const double negative : {0.0, 0.05, 0.4}) {
    fill_randomly(matrix, negative, random);
    (void)solver.factor(matrix);
    const BorderedSolver bordered(solver, rows_, none);
    EXPECT_EQ(bordered.negative(), negative_on_constraints(matrix.to_sparse()));
    EXPECT_EQ(bordered.positive_definite(), negative == 0);
  }
  // Unstable in one angle only, and that angle is held.
  fill_randomly(matrix, 0, random);
  matrix.joint(3)[6 * 10] -= 1e4;
  EXPECT_EQ(solver.factor(matrix).negative, 1);
  EXPECT_TRUE(BorderedSolver(solver, rows_, none).positive_definite());
  EXPECT_EQ(BorderedSolver(solver, rows_, Eigen::Vector3d(1, 1, 1)).negative(), 1);
}

TEST_F(BorderedSolverTest, WithoutRowsIsThePlainSolve) {
  Random random(4);
  CondensedMatrix matrix(structure_);
  CondensedSolver solver(structure_);
  fill_randomly(matrix, 0.2, random);
  (void)solver.factor(matrix);
  const BorderedSolver bordered(solver, Eigen::MatrixXd(0, structure_->size()), Eigen::VectorXd(0));
  EXPECT_EQ(bordered.negative(), solver.pivots().negative);
  Eigen::VectorXd x = Eigen::VectorXd::Ones(structure_->size()), y(0);
  Eigen::VectorXd plain = x;
  bordered.solve_in_place(x, y);
  solver.solve_in_place(plain);
  EXPECT_EQ(x, plain);
}

TEST_F(BorderedSolverTest, DependentRowsAreRefused) {
  Random random(3);
  CondensedMatrix matrix(structure_);
  CondensedSolver solver(structure_);
  fill_randomly(matrix, 0, random);
  (void)solver.factor(matrix);
  rows_.row(2) = rows_.row(1) * 2;
  try {
    (void)BorderedSolver(solver, rows_, Eigen::VectorXd::Zero(3));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNumerical);
    EXPECT_EQ(error.field(), "rows");
  }
}

}  // namespace
}  // namespace limber::rods
