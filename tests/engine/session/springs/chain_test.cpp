#include "tests/engine/session/springs/chain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::session::springs {
namespace {

/// Springs of stiffness 10 N/m in a row along x, pinned at both ends, with a load at the middle.
Chain loaded_row(int springs, double spacing, double rest_length, double force) {
  Chain chain;
  chain.nodes = Shape::Zero(3, springs + 1);
  for (int i = 0; i <= springs; ++i) chain.nodes(0, i) = spacing * i;
  chain.springs.assign(static_cast<std::size_t>(springs), {10, rest_length});
  chain.conditions.pins = {{0, chain.nodes.col(0)}, {springs, chain.nodes.col(springs)}};
  chain.conditions.loads = {{springs / 2, {0, 0, -force}}};
  return chain;
}

Equilibrium solve(const Chain& chain) {
  return find_equilibrium(chain, chain.conditions, chain.nodes, {}, [](const Shape&) {});
}

TEST(SpringChain, DerivativesAgreeWithDifferences) {
  constexpr double kStep = 1e-6;
  const Chain chain = loaded_row(4, 1, 0.7, 3);
  Shape shape = chain.nodes;  // some springs stretched, some compressed, none along an axis
  for (Eigen::Index i = 0; i < shape.size(); ++i)
    shape.data()[i] += 0.4 * std::sin(7.0 * static_cast<double>(i) + 1);
  const Potential p = potential(chain, chain.conditions, shape);
  for (Eigen::Index j = 0; j < shape.size(); ++j) {
    Shape plus = shape, minus = shape;
    plus.data()[j] += kStep;
    minus.data()[j] -= kStep;
    const Potential above = potential(chain, chain.conditions, plus);
    const Potential below = potential(chain, chain.conditions, minus);
    EXPECT_NEAR(p.gradient[j], (above.value() - below.value()) / (2 * kStep), 1e-6) << j;
    for (Eigen::Index i = j; i < shape.size(); ++i) {
      const double entry = i - j < p.hessian.rows() ? p.hessian(i - j, j) : 0;
      EXPECT_NEAR(entry, (above.gradient[i] - below.gradient[i]) / (2 * kStep), 1e-5)
          << i << ", " << j;
    }
  }
}

/// Five springs a side, each 1 m long in the end: half of the span, the sag and the side are 3, 4
/// and 5 m. At 0.5 m more than their rest length they pull with 5 N: the load is 2 * 5 N * 4 / 5.
TEST(SpringChain, SagsUnderALoadAtTheMiddle) {
  const Chain chain = loaded_row(10, 0.6, 0.5, 8);
  const Equilibrium reached = solve(chain);
  ASSERT_EQ(reached.report.status, Status::kConverged) << reached.report.message;
  for (int i = 0; i <= 10; ++i) {
    const double sag = 0.8 * std::min(i, 10 - i);
    EXPECT_LT((reached.shape.col(i) - Eigen::Vector3d(0.6 * i, 0, -sag)).norm(), 1e-7) << i;
  }
  EXPECT_NEAR(reached.report.elastic, 10 * 10 / 2.0 * 0.25, 1e-7);
}

/// The same with 4, 3 and 5 m, drawn at rest length: nothing resists the load at first.
TEST(SpringChain, SagsFromAShapeWithoutTension) {
  const Equilibrium reached = solve(loaded_row(10, 0.8, 0.8, 2 * 2 * 3 / 5.0));
  ASSERT_EQ(reached.report.status, Status::kConverged) << reached.report.message;
  EXPECT_LT((reached.shape.col(5) - Eigen::Vector3d(4, 0, -3)).norm(), 1e-7);
}

TEST(SpringChain, LoadsOnAChainWithoutPinsAreRefused) {
  Chain chain = loaded_row(4, 1, 1, 1);
  chain.conditions.pins.clear();
  EXPECT_THROW((void)solve(chain), Error);
  chain.conditions.loads.clear();
  EXPECT_EQ(solve(chain).report.status, Status::kConverged) << "as drawn, at rest";
}

TEST(SpringChain, ACancelledSolveKeepsItsIterate) {
  const Chain chain = loaded_row(10, 0.6, 0.5, 8);
  Cancellation cancellation;
  Shape last;
  const Equilibrium reached =
      find_equilibrium(chain, chain.conditions, chain.nodes, cancellation, [&](const Shape& shape) {
        last = shape;
        cancellation.request();
      });
  EXPECT_EQ(reached.report.status, Status::kCancelled);
  EXPECT_EQ(reached.report.iterations, 1);
  EXPECT_EQ(reached.shape, last);
}

TEST(SpringChain, WhatIsNoChainIsRefused) {
  Chain chain = loaded_row(4, 1, 1, 1);
  EXPECT_NO_THROW(validate(chain));
  chain.conditions.loads[5] = {0, 0, 1};
  EXPECT_THROW(validate(chain), Error);
  chain = loaded_row(4, 1, 0, 1);
  EXPECT_THROW(validate(chain), Error);
  chain.springs.pop_back();
  EXPECT_THROW(validate(chain), Error);
}

}  // namespace
}  // namespace limber::session::springs
