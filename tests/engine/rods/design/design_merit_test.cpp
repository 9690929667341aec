#include "engine/rods/design/design_merit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::rods::detail {
namespace {

using Verdict = ViolationWatch::Verdict;
constexpr double kHolds = DesignRank::kHolds;

TEST(DesignRank, WhatKeepsTheConstraintsComesBeforeWhatDoesNot) {
  const auto before = [](const DesignRank& one, const DesignRank& other) {
    EXPECT_FALSE(one.before(one));
    EXPECT_FALSE(other.before(one));
    return one.before(other);
  };
  const DesignRank dear = DesignRank::of(5, 0.1), cheap = DesignRank::of(1, 0);
  const DesignRank little = DesignRank::of(0.5, -0.1), more = DesignRank::of(0.1, -0.2);
  EXPECT_TRUE(before(cheap, dear));
  EXPECT_TRUE(before(dear, little));
  EXPECT_TRUE(before(little, more));
  // What is violated by next to nothing holds.
  EXPECT_TRUE(before(DesignRank::of(0.9, -0.99 * kHolds), cheap));
  EXPECT_TRUE(before(cheap, DesignRank::of(0.9, -1.01 * kHolds)));
}

/// Of a violation by step.
template <class Violation>
std::vector<Verdict> verdicts(int steps, const Violation& violation) {
  ViolationWatch watch;
  std::vector<Verdict> verdicts_seen;
  for (int k = 0; k < steps; ++k) verdicts_seen.push_back(watch.see(violation(k), k));
  return verdicts_seen;
}
auto count(const std::vector<Verdict>& verdicts_seen, Verdict verdict) {
  return std::count(verdicts_seen.begin(), verdicts_seen.end(), verdict);
}

TEST(ViolationWatch, GivesUpWhatNothingLessens) {
  const auto verdicts_seen = verdicts(76, [](int) { return 0.3; });
  EXPECT_EQ(count(verdicts_seen, Verdict::kRaise), 4);
  EXPECT_EQ(verdicts_seen.back(), Verdict::kHopeless);
  EXPECT_EQ(count(verdicts_seen, Verdict::kHopeless), 1);
}

TEST(ViolationWatch, WaitsForWhatLessensSlowly) {
  const auto verdicts_seen = verdicts(400, [](int k) { return std::pow(0.99, k / 10); });
  EXPECT_EQ(count(verdicts_seen, Verdict::kHopeless), 0);
}

TEST(ViolationWatch, SeesNothingWhereConstraintsHold) {
  const auto holds = verdicts(400, [](int) { return 0.0; });
  EXPECT_EQ(count(holds, Verdict::kFine), 400);
  // Held in between: what is violated later begins anew.
  const auto verdicts_seen = verdicts(120, [](int k) { return k == 60 ? 0.0 : 0.3; });
  EXPECT_EQ(count(verdicts_seen, Verdict::kHopeless), 0);
}

/// Least of w (x - 1)^2 / 2 with x <= bound, by the augmented Lagrangian.
struct Bounded {
  double weight, bound;
  AugmentedConstraint constraint = {};
  double x = 1;

  void minimise() {
    // Convex and piecewise quadratic: bisection of its slope.
    double low = -10, high = 10;
    for (int k = 0; k < 100; ++k) {
      x = 0.5 * (low + high);
      const double slope = weight * (x - 1) + constraint.force(bound - x);
      (slope > 0 ? high : low) = x;
    }
  }
  [[nodiscard]] double left() const { return constraint.left(bound - x); }
};

TEST(AugmentedConstraint, ComesToItsBoundAndToTheForceThere) {
  for (const double weight : {0.1, 10.0, 1e4}) {
    Bounded problem{weight, 0.6};
    for (int k = 0; k < 30; ++k) {
      problem.minimise();
      if (problem.left() < kHolds && k > 0) break;
      problem.constraint.update(problem.bound - problem.x);
    }
    EXPECT_NEAR(problem.x, 0.6, 2 * kHolds) << weight;
    EXPECT_NEAR(problem.constraint.force(problem.bound - problem.x), 0.4 * weight, 3e-3 * weight);
  }
}

TEST(AugmentedConstraint, LetsGoOfWhatItPressedTooMuch) {
  Bounded problem{10, 0.6};
  // Violated for long, as by steps that were cut short.
  for (int k = 0; k < 4; ++k) problem.constraint.update(-0.5);
  problem.minimise();
  EXPECT_LT(problem.x, 0.55);
  EXPECT_GT(problem.left(), kHolds);
  for (int k = 0; k < 30 && problem.left() > kHolds; ++k) {
    problem.constraint.update(problem.bound - problem.x);
    problem.minimise();
  }
  EXPECT_NEAR(problem.x, 0.6, 2 * kHolds);
}

TEST(AugmentedConstraint, LeavesAloneWhatHoldsByItself) {
  Bounded problem{10, 1.5};
  problem.minimise();
  EXPECT_NEAR(problem.x, 1, 1e-9);
  EXPECT_EQ(problem.left(), 0);
}

TEST(GuardWeight, HindersWhereItWeighsBesideTheObjective) {
  GuardWeight guard;
  EXPECT_FALSE(guard.hinders(1, 1));
  guard.raise_at_once(100, 5);  // to a quarter of the objective
  EXPECT_FALSE(guard.hinders(100, 5));
  EXPECT_TRUE(guard.hinders(20, 5));
  EXPECT_TRUE(guard.hinders(100, 50));
}

TEST(GuardWeight, GoesUpSoOftenAndNoFurther) {
  GuardWeight guard;
  int raised = 0;
  double last = 0;
  while (guard.raise(100, 5) && raised < 100) {
    EXPECT_GT(guard.weight(), last);
    last = guard.weight();
    ++raised;
  }
  EXPECT_GT(raised, 3);
  EXPECT_LT(raised, 20);
  EXPECT_EQ(guard.weight(), last);
}

TEST(GuardWeight, ComesDownToNothing) {
  GuardWeight guard;
  guard.raise_at_once(100, 5);
  for (int k = 0; k < 40 && guard.weight() > 0; ++k) guard.lower();
  EXPECT_EQ(guard.weight(), 0);
}

}  // namespace
}  // namespace limber::rods::detail
