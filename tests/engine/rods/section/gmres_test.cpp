#include "engine/rods/section/gmres.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace limber::rods {
namespace {

TEST(Gmres, SolvesASmallPartAwayFromTheIdentity) {
  const Eigen::Index n = 30;
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) a(i, j) += 0.3 / static_cast<double>(1 + i + 2 * j);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, 1, 2);
  const GmresResult result = gmres([&](const Eigen::VectorXd& v) { return a * v; }, b, 1e-12);
  EXPECT_TRUE(result.is_converged);
  EXPECT_LT(result.iterations, n);
  EXPECT_LT(result.relative_residual, 1e-11);
  EXPECT_LT((result.x - a.partialPivLu().solve(b)).norm(), 1e-10 * b.norm());
}

TEST(Gmres, OfZeroIsZeroWithoutAProduct) {
  const auto refuse = [](const Eigen::VectorXd&) -> Eigen::VectorXd {
    ADD_FAILURE() << "a product";
    return Eigen::VectorXd::Zero(3);
  };
  const GmresResult result = gmres(refuse, Eigen::VectorXd::Zero(3), 1e-12);
  EXPECT_TRUE(result.is_converged);
  EXPECT_TRUE(result.x.isZero(0));
}

// A cyclic shift of n numbers leaves the residual where it is until iteration n.
Eigen::VectorXd shifted(const Eigen::VectorXd& v) {
  Eigen::VectorXd result(v.size());
  result << v.tail(v.size() - 1), v.head(1);
  return result;
}

TEST(Gmres, ReportsThatIterationsRanOut) {
  const Eigen::VectorXd b = Eigen::VectorXd::Unit(20, 0);
  const GmresResult stopped = gmres(shifted, b, 1e-12, 10);
  EXPECT_FALSE(stopped.is_converged);
  EXPECT_EQ(stopped.iterations, 10);
  EXPECT_NEAR(stopped.relative_residual, 1, 1e-12);
  const GmresResult solved = gmres(shifted, b, 1e-12);
  EXPECT_TRUE(solved.is_converged);
  EXPECT_EQ(solved.iterations, 20);
  EXPECT_LT(solved.relative_residual, 1e-12);
}

TEST(Gmres, DoesNotReportASolutionOfASingularSystem) {
  const auto vanish = [](const Eigen::VectorXd& v) {
    return Eigen::VectorXd(Eigen::VectorXd::Zero(v.size()));
  };
  const GmresResult result = gmres(vanish, Eigen::VectorXd::Ones(3), 1e-12);
  EXPECT_FALSE(result.is_converged);
}

}  // namespace
}  // namespace limber::rods
