#include "engine/reduced/snapshot_basis.h"

#include <gtest/gtest.h>

#include "tests/engine/reduced/basis_checks.h"
#include "tests/engine/reduced/random_values.h"

namespace limber::reduced {
namespace {

using testing::left_over;
using testing::random_matrix;

Eigen::VectorXd masses(Eigen::Index nodes) { return Eigen::VectorXd::LinSpaced(nodes, 0.5, 4); }

void expect_orthonormal(const Eigen::MatrixXd& b) {
  EXPECT_LT((b.transpose() * b - Eigen::MatrixXd::Identity(b.cols(), b.cols())).norm(), 1e-12);
}

TEST(SnapshotBasis, AsManyColumnsAsThePosesSpan) {
  const Eigen::MatrixXd u = random_matrix(60, 5, 1) * random_matrix(5, 40, 2);
  const Eigen::MatrixXd b = snapshot_basis(u, masses(20), Eigen::MatrixXd(60, 0), 30);
  EXPECT_EQ(5, b.cols());
  expect_orthonormal(b);
  EXPECT_LT(left_over(b, u), 1e-10);
}

TEST(SnapshotBasis, ExactFieldsComeFirstAndAreNotCountedTwice) {
  const Eigen::MatrixXd exact = random_matrix(60, 4, 3), more = random_matrix(60, 3, 4);
  Eigen::MatrixXd both(60, 7);
  both << exact, more;
  const Eigen::MatrixXd u = both * random_matrix(7, 40, 5);
  const Eigen::MatrixXd b = snapshot_basis(u, masses(20), exact, 30);
  EXPECT_EQ(7, b.cols());
  expect_orthonormal(b);
  EXPECT_LT(left_over(b.leftCols(4), exact), 1e-12);
  EXPECT_LT(left_over(b, u), 1e-10);
}

TEST(SnapshotBasis, PosesWithinTheExactFieldsAddNothing) {
  const Eigen::MatrixXd exact = random_matrix(60, 4, 3);
  const Eigen::MatrixXd u = exact * random_matrix(4, 40, 5);
  EXPECT_EQ(4, snapshot_basis(u, masses(20), exact, 30).cols());
  EXPECT_EQ(4, snapshot_basis(Eigen::MatrixXd::Zero(60, 3), masses(20), exact, 30).cols());
}

// Two nodes have no room for more than six columns, four of them taken.
TEST(SnapshotBasis, NeverMoreColumnsThanRows) {
  const Eigen::MatrixXd exact = random_matrix(6, 4, 3), u = random_matrix(6, 40, 6);
  const Eigen::MatrixXd b = snapshot_basis(u, masses(2), exact, 30);
  EXPECT_EQ(6, b.cols());
  expect_orthonormal(b);
  EXPECT_LT(left_over(b, u), 1e-12);
  const Eigen::MatrixXd all = random_matrix(6, 6, 7);
  EXPECT_EQ(6, snapshot_basis(u, masses(2), all, 30).cols());
}

TEST(SnapshotBasis, NestedAndOfTheLargestDirectionsFirst) {
  Eigen::MatrixXd u = random_matrix(60, 40, 8);
  u.row(7) *= 30;
  const Eigen::MatrixXd large = snapshot_basis(u, masses(20), Eigen::MatrixXd(60, 0), 20),
                        small = snapshot_basis(u, masses(20), Eigen::MatrixXd(60, 0), 8);
  EXPECT_LT((large.leftCols(8) - small).norm(), 1e-12);
  EXPECT_GT(std::abs(small(7, 0)), 0.9);
}

}  // namespace
}  // namespace limber::reduced
