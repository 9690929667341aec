// Steps of Newton's method in a trust region, against what linear algebra says.
#include "engine/rods/design/trust_region_step.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "tests/support/dense.h"

namespace limber::rods::detail {
namespace {

constexpr int kSize = 20;

struct Quadratic {
  explicit Quadratic(double least) {
    Random random(7);
    Eigen::MatrixXd any(kSize, kSize);
    for (double& value : any.reshaped()) value = random.normal();
    const Eigen::MatrixXd turn = reference::ThinQr(any).q();
    Eigen::VectorXd eigenvalues(kSize);
    for (int i = 0; i < kSize; ++i) eigenvalues[i] = std::pow(10.0, 4.0 * i / (kSize - 1));
    eigenvalues[0] = least;
    hessian = turn * eigenvalues.asDiagonal() * turn.transpose();
    slope.resize(kSize);
    for (double& value : slope) value = random.normal();
  }
  ModelStep step(const TrustRegion& region) {
    products = 0;
    return trust_region_step(
        slope, region,
        [&](const Eigen::VectorXd& v) {
          ++products;
          return Eigen::VectorXd(hessian * v);
        },
        memory);
  }
  [[nodiscard]] double value(const Eigen::VectorXd& p) const {
    return slope.dot(p) + 0.5 * p.dot(hessian * p);
  }
  Eigen::MatrixXd hessian;
  Eigen::VectorXd slope;
  CurvatureMemory memory;
  int products = 0;
};

TEST(TrustRegionStep, IsNewtonsWhereTheRegionIsLarge) {
  Quadratic problem(1);
  const ModelStep step = problem.step({1e6, 1e-9 * problem.slope.norm(), 500});
  const Eigen::VectorXd exact = reference::solve_symmetric(problem.hessian, -problem.slope);
  EXPECT_TRUE(step.complete);
  EXPECT_FALSE(step.at_rim);
  EXPECT_LT((step.p - exact).norm(), 1e-7 * exact.norm());
  EXPECT_LT((step.bent - problem.hessian * step.p).norm(), 1e-7 * step.bent.norm());
}

TEST(TrustRegionStep, WhatWasLearnedMakesTheNextOneShort) {
  Quadratic problem(1);
  (void)problem.step({1e6, 1e-9 * problem.slope.norm(), 500});
  const int first = problem.products;
  problem.slope = problem.slope.reverse().eval();
  const ModelStep step = problem.step({1e9, 1e-6 * problem.slope.norm(), 500});
  EXPECT_TRUE(step.complete);
  EXPECT_GE(first, kSize);
  EXPECT_LE(problem.products, 3);
}

TEST(TrustRegionStep, EndsAtTheRimAsTheMemoryMeasuresIt) {
  Quadratic problem(1);
  constexpr double kRadius = 1e-3;
  ModelStep step = problem.step({kRadius, 0, 500});
  EXPECT_TRUE(step.at_rim);
  EXPECT_NEAR(step.p.norm(), kRadius, 1e-12);
  (void)problem.step({1e6, 1e-9 * problem.slope.norm(), 500});
  const CurvatureMemory memory = problem.memory;
  step = problem.step({kRadius, 0, 500});
  EXPECT_TRUE(step.at_rim);
  EXPECT_NEAR(memory.size(step.p), kRadius, 1e-9);
  EXPECT_LT(problem.value(step.p), 0);
}

TEST(TrustRegionStep, FollowsNegativeCurvatureToTheRim) {
  Quadratic problem(-1);
  const ModelStep step = problem.step({10, 0, 500});
  EXPECT_TRUE(step.at_rim);
  EXPECT_FALSE(step.complete);
  EXPECT_LT(problem.value(step.p), 0);
}

TEST(TrustRegionStep, ComponentsWithoutSlopeStay) {
  Quadratic problem(1);
  problem.slope[3] = problem.slope[11] = 0;
  (void)problem.step({1e6, 0, 60});
  const ModelStep step = problem.step({1e6, 0, 60});
  EXPECT_EQ(step.p[3], 0);
  EXPECT_EQ(step.p[11], 0);
  EXPECT_EQ(step.bent[3], 0);
}

TEST(CurvatureMemory, MeasuresAndInvertsAMatrixKnownCompletely) {
  Quadratic problem(1);
  (void)problem.step({1e6, 1e-12 * problem.slope.norm(), 500});
  const Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(kSize, -1, 2);
  EXPECT_NEAR(problem.memory.size(v), std::sqrt(v.dot(problem.hessian * v)),
              1e-4 * problem.memory.size(v));
  EXPECT_LT((problem.memory.inverse_times(problem.hessian * v) - v).norm(), 1e-4 * v.norm());
}

TEST(CurvatureMemory, LearnsNothingFromNegativeCurvature) {
  CurvatureMemory memory;
  const Eigen::VectorXd v = Eigen::VectorXd::Ones(4);
  memory.note(v, -v);
  EXPECT_TRUE(memory.empty());
  EXPECT_EQ(memory.inverse_times(v), v);
  EXPECT_EQ(memory.size(v), 2);
}

}  // namespace
}  // namespace limber::rods::detail
