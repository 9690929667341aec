#include "engine/base/numerics/nnls.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "tests/engine/base/numerics/random_matrix.h"
#include "tests/support/dense.h"

namespace limber {
namespace {

using testing::random_matrix;

// x >= 0, gradient A^T (A x - b) >= 0, and their product 0: necessary and sufficient.
void expect_optimal(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const NnlsResult& result,
                    double tolerance) {
  EXPECT_TRUE(result.converged);
  ASSERT_EQ(result.x.size(), a.cols());
  const Eigen::VectorXd gradient = a.transpose() * (a * result.x - b);
  const Eigen::VectorXd norms = a.colwise().norm();
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    EXPECT_GE(result.x[j], 0);
    const double scale = norms[j] * b.norm();
    EXPECT_GE(gradient[j], -tolerance * scale) << "column " << j;
    if (result.x[j] > 0) {
      EXPECT_NEAR(gradient[j], 0, tolerance * scale) << "column " << j;
    }
  }
}

// The best of all active sets, by enumeration.
double best_energy(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  double best = 0.5 * b.squaredNorm();
  for (unsigned set = 1; set < (1u << a.cols()); ++set) {
    std::vector<int> columns;
    for (int j = 0; j < a.cols(); ++j) {
      if (set >> j & 1) columns.push_back(j);
    }
    const Eigen::MatrixXd part = a(Eigen::all, columns);
    const Eigen::VectorXd x = reference::ThinQr(part).least_squares(b);
    if (x.minCoeff() < 0) continue;
    best = std::min(best, 0.5 * (part * x - b).squaredNorm());
  }
  return best;
}

TEST(Nnls, KnownAnswerInTwoDimensions) {
  // min (x - 1)^2 + (y + 2)^2: y is held at its bound.
  const Eigen::Matrix2d gram = Eigen::Matrix2d::Identity();
  const NnlsResult result = nnls(gram, Eigen::Vector2d(1, -2));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.x, Eigen::Vector2d(1, 0));
  EXPECT_EQ(result.support, std::vector<int>{0});
}

TEST(Nnls, RecoversAPositiveSolution) {
  const Eigen::MatrixXd a = random_matrix(60, 20, 1);
  const Eigen::VectorXd truth = random_matrix(20, 1, 2).cwiseAbs();
  const NnlsResult result = nnls(a.transpose() * a, a.transpose() * a * truth);
  EXPECT_TRUE(result.converged);
  EXPECT_LT((result.x - truth).norm(), 1e-10 * truth.norm());
}

TEST(Nnls, AgreesWithEnumerationOfAllActiveSets) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Eigen::MatrixXd a = random_matrix(12, 9, seed);
    const Eigen::VectorXd b = random_matrix(12, 1, 1000 + seed);
    const NnlsResult result = nnls(a.transpose() * a, a.transpose() * b);
    const double best = best_energy(a, b);
    EXPECT_NEAR(0.5 * (a * result.x - b).squaredNorm(), best, 1e-10 * best) << "seed " << seed;
  }
}

TEST(Nnls, MeetsOptimalityConditionsAtCubatureSize) {
  const Eigen::MatrixXd a = random_matrix(3000, 120, 5);
  const Eigen::VectorXd b = random_matrix(3000, 1, 6);
  const NnlsResult result = nnls(a.transpose() * a, a.transpose() * b);
  expect_optimal(a, b, result, 1e-9);
  EXPECT_LT(result.optimality, 1e-9);
  EXPECT_GT(result.support.size(), 20u);
  EXPECT_LT(result.support.size(), 100u);
}

TEST(Nnls, BadlyScaledColumns) {
  Eigen::MatrixXd a = random_matrix(50, 12, 7);
  for (int j = 0; j < 12; ++j) a.col(j) *= std::pow(10.0, j - 6);
  const Eigen::VectorXd b = random_matrix(50, 1, 8) * 1e5;
  expect_optimal(a, b, nnls(a.transpose() * a, a.transpose() * b), 1e-9);
}

TEST(Nnls, RepeatedAndZeroColumns) {
  Eigen::MatrixXd a(40, 15);
  a.leftCols(7) = random_matrix(40, 7, 9);
  a.middleCols(7, 7) = a.leftCols(7);
  a.col(14).setZero();
  const Eigen::VectorXd b = random_matrix(40, 1, 10);
  const NnlsResult result = nnls(a.transpose() * a, a.transpose() * b);
  expect_optimal(a, b, result, 1e-9);
  EXPECT_EQ(result.x[14], 0);
  const NnlsResult plain =
      nnls(a.leftCols(7).transpose() * a.leftCols(7), a.leftCols(7).transpose() * b);
  EXPECT_NEAR((a * result.x - b).norm(), (a.leftCols(7) * plain.x - b).norm(), 1e-10);
}

TEST(Nnls, NearlyDependentColumns) {
  Eigen::MatrixXd a = random_matrix(80, 30, 11);
  for (int j = 1; j < 30; ++j) a.col(j) = a.col(0) + 1e-4 * a.col(j);
  const Eigen::VectorXd b = a * random_matrix(30, 1, 12).cwiseAbs();
  expect_optimal(a, b, nnls(a.transpose() * a, a.transpose() * b), 1e-8);
}

TEST(Nnls, WarmStartGivesTheSameAnswerInFewerSteps) {
  const Eigen::MatrixXd a = random_matrix(500, 100, 13);
  const Eigen::VectorXd b = random_matrix(500, 1, 14);
  const Eigen::MatrixXd gram = a.transpose() * a;
  const Eigen::VectorXd rhs = a.transpose() * b;
  const NnlsResult cold = nnls(gram, rhs);
  const NnlsResult warm = nnls(gram, rhs, {}, cold.support);
  EXPECT_EQ(warm.support, cold.support);
  EXPECT_LT((warm.x - cold.x).norm(), 1e-10 * cold.x.norm());
  EXPECT_LT(warm.iterations, cold.iterations / 4);
  std::vector<int> wrong;
  for (int j = 0; j < 100; j += 2) wrong.push_back(j);
  const NnlsResult recovered = nnls(gram, rhs, {}, wrong);
  expect_optimal(a, b, recovered, 1e-9);
}

TEST(Nnls, NothingToGain) {
  const Eigen::MatrixXd a = random_matrix(30, 5, 15).cwiseAbs();
  const NnlsResult result = nnls(a.transpose() * a, -a.transpose() * Eigen::VectorXd::Ones(30));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.x, Eigen::VectorXd::Zero(5));
  EXPECT_TRUE(nnls(Eigen::MatrixXd(0, 0), Eigen::VectorXd(0)).converged);
}

TEST(Nnls, StopsAtTheIterationLimit) {
  const Eigen::MatrixXd a = random_matrix(200, 60, 16);
  NnlsOptions options;
  options.max_iterations = 3;
  const NnlsResult result =
      nnls(a.transpose() * a, a.transpose() * random_matrix(200, 1, 17), options);
  EXPECT_FALSE(result.converged);
  EXPECT_GE(result.x.minCoeff(), 0);
}

TEST(Nnls, RefusesBadInput) {
  const auto field_of = [](const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("accepted");
  };
  const Eigen::Matrix2d good = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d bad = good;
  bad(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(field_of([&] { (void)nnls(bad, Eigen::Vector2d::Ones()); }), "gram");
  EXPECT_EQ(field_of([&] { (void)nnls(good, Eigen::Vector3d::Ones()); }), "gram");
  EXPECT_EQ(field_of([&] { (void)nnls(good, Eigen::Vector2d(1, INFINITY)); }), "rhs");
  EXPECT_EQ(field_of([&] { (void)nnls(-good, Eigen::Vector2d::Ones()); }), "gram");
  EXPECT_EQ(field_of([&] { (void)nnls(good, Eigen::Vector2d::Ones(), {}, {2}); }), "warm_support");
  EXPECT_EQ(field_of([&] { (void)nnls(good, Eigen::Vector2d::Ones(), {.tolerance = 0}); }),
            "tolerance");
}

}  // namespace
}  // namespace limber
