#include "engine/base/numerics/line_search.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/error.h"

namespace limber {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// (4 t - 1)^2: 1 and slope -8 at 0, least at 1/4.
double steep(double t) { return (4 * t - 1) * (4 * t - 1); }
constexpr SufficientDecrease kSteep{1, -8};

TEST(LineSearch, TakesTheWholeStepOfAQuadraticModel) {
  const auto found = backtrack({0, -1}, {}, [](double t) { return 0.5 * t * t - t; });
  EXPECT_TRUE(found.is_accepted);
  EXPECT_EQ(found.step, 1);
  EXPECT_EQ(found.value, -0.5);
  EXPECT_EQ(found.trials, 1);
}

TEST(LineSearch, HalvesUntilTheDecreaseIsSufficient) {
  std::vector<double> tried;
  const auto found = backtrack(kSteep, {}, [&](double t) {
    tried.push_back(t);
    return steep(t);
  });
  EXPECT_TRUE(found.is_accepted);
  // At 1/2 the value is that at 0: no decrease.
  EXPECT_EQ(tried, (std::vector<double>{1, 0.5, 0.25}));
  EXPECT_EQ(found.step, 0.25);
  EXPECT_EQ(found.value, 0);
  EXPECT_EQ(found.trials, 3);
}

TEST(LineSearch, AcceptsAtTheBoundAndNotAboveIt) {
  const SufficientDecrease decrease{2, -4, 1};
  const double bound = 2 - kArmijoShare * 0.5 * 4 + 1;
  EXPECT_EQ(decrease.bound(0.5), bound);
  EXPECT_TRUE(decrease.accepts(0.5, bound));
  EXPECT_FALSE(decrease.accepts(0.5, std::nextafter(bound, kInfinity)));
}

TEST(LineSearch, StepsBackFromEnergiesThatAreNotFinite) {
  for (const double undefined : {kNan, kInfinity}) {
    const auto found =
        backtrack({0, -1}, {}, [&](double t) { return t > 0.1 ? undefined : t * t - t; });
    EXPECT_TRUE(found.is_accepted);
    EXPECT_EQ(found.step, 0.0625);
  }
}

TEST(LineSearch, EndsWhereAllEnergiesAreNaN) {
  const auto found = backtrack({0, -1}, {.max_trials = 12}, [](double) { return kNan; });
  EXPECT_FALSE(found.is_accepted);
  EXPECT_EQ(found.step, 0);
  EXPECT_EQ(found.trials, 12);
  EXPECT_TRUE(std::isnan(found.value));
}

TEST(LineSearch, AcceptsNothingWithoutAValueToBeginFrom) {
  const auto falls = [](double t) { return -t; };
  EXPECT_FALSE(backtrack({kNan, -1}, {}, falls).is_accepted);
  EXPECT_FALSE(backtrack({0, kNan}, {}, falls).is_accepted);
}

TEST(LineSearch, RefusesToClimbAlongAnAscentDirection) {
  // Armijo's rule with this slope as it is would accept it: 1e-5 t < 1e-4 t.
  const auto found = backtrack({0, 1}, {.shortest_step = 1e-9}, [](double t) { return 1e-5 * t; });
  EXPECT_FALSE(found.is_accepted);
  // A direction of wrong sign along which the value falls all the same is taken.
  EXPECT_TRUE(backtrack({0, 1}, {}, [](double t) { return -t; }).is_accepted);
}

TEST(LineSearch, EndsWhereStepsAreTooShort) {
  std::vector<double> tried;
  const auto found = backtrack({0, -1}, {.shortest_step = 0.2}, [&](double t) {
    tried.push_back(t);
    return 1.0;
  });
  EXPECT_FALSE(found.is_accepted);
  EXPECT_EQ(tried, (std::vector<double>{1, 0.5, 0.25}));
  // The shortest step itself is not tried.
  const auto none =
      backtrack({0, -1}, {.first_step = 0.2, .shortest_step = 0.2}, [](double) { return -1.0; });
  EXPECT_EQ(none.trials, 0);
}

TEST(LineSearch, AnEnergyFlatToRoundingIsAcceptedWithinRoundingOnly) {
  // A step of 1e-9 gains 1e-18 of 1e3: what is seen is rounding, here upwards.
  const double energy = 1e3, seen = std::nextafter(energy, kInfinity);
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * energy;
  const BacktrackOptions options{.first_step = 1e-9, .max_trials = 8};
  const auto flat = [&](double) { return seen; };
  EXPECT_FALSE(backtrack({energy, -1e-9}, options, flat).is_accepted);
  const auto found = backtrack({energy, -1e-9, rounding}, options, flat);
  EXPECT_TRUE(found.is_accepted);
  EXPECT_EQ(found.trials, 1);
}

TEST(LineSearch, TheParabolaOfAQuadraticEndsInItsMinimum) {
  EXPECT_DOUBLE_EQ(kSteep.shorter(1, steep(1)), 0.25);
  EXPECT_DOUBLE_EQ(kSteep.shorter(0.6, steep(0.6)), 0.25);
}

TEST(LineSearch, StepsOfTheParabolaAreBounded) {
  EXPECT_DOUBLE_EQ(kSteep.shorter(1, 1e6), 0.1);
  // A value on the tangent has its minimum far ahead.
  EXPECT_DOUBLE_EQ(kSteep.shorter(0.5, 1 - 8 * 0.5 + 1e-12), 0.25);
  EXPECT_EQ(kSteep.shorter(0.5, kNan), 0.125);
  EXPECT_EQ(kSteep.shorter(0.5, kInfinity), 0.125);
}

TEST(LineSearch, ByParabolasFindsTheMinimumOfAQuadraticAtOnce) {
  const auto found = backtrack({}, [](double t) {
    return kSteep.accepts(t, steep(t)) ? StepVerdict::accept()
                                       : StepVerdict::retry(kSteep.shorter(t, steep(t)));
  });
  EXPECT_TRUE(found.is_accepted);
  EXPECT_DOUBLE_EQ(found.step, 0.25);
  EXPECT_EQ(found.trials, 2);
}

TEST(LineSearch, TriesTheSameStepByOtherMeans) {
  bool is_bent = false;
  const auto found = backtrack({.first_step = 0.5}, [&](double t) {
    if (is_bent) return StepVerdict::accept();
    is_bent = true;
    return StepVerdict::retry(t);
  });
  EXPECT_TRUE(found.is_accepted);
  EXPECT_EQ(found.step, 0.5);
  EXPECT_EQ(found.trials, 2);
}

TEST(LineSearch, EndsWhereAnAttemptAsksForNoStep) {
  for (const double next : {0.0, -1.0, kNan}) {
    const auto found = backtrack({}, [&](double) { return StepVerdict::retry(next); });
    EXPECT_FALSE(found.is_accepted);
    EXPECT_EQ(found.trials, 1);
  }
  const auto endless = backtrack({}, [](double t) { return StepVerdict::retry(t); });
  EXPECT_EQ(endless.trials, BacktrackOptions{}.max_trials);
}

TEST(LineSearch, NewtonsMethodWithItReachesTheMinimumOfRosenbrocksValley) {
  Eigen::Vector2d x(-1.2, 1);
  const auto value = [](const Eigen::Vector2d& at) {
    return 100 * std::pow(at[1] - at[0] * at[0], 2) + std::pow(1 - at[0], 2);
  };
  int shortened = 0, steps = 0;
  for (; steps < 50; ++steps) {
    const double across = x[1] - x[0] * x[0];
    const Eigen::Vector2d gradient(-400 * across * x[0] - 2 * (1 - x[0]), 200 * across);
    if (gradient.norm() < 1e-12) break;
    Eigen::Matrix2d hessian;
    hessian << 800 * x[0] * x[0] - 400 * across + 2, -400 * x[0], -400 * x[0], 200;
    const Eigen::Vector2d step = -hessian.inverse() * gradient;
    const auto found = backtrack({value(x), gradient.dot(step)}, {},
                                 [&](double t) { return value(x + t * step); });
    ASSERT_TRUE(found.is_accepted);
    EXPECT_LT(found.value, value(x));
    shortened += found.step < 1 ? 1 : 0;
    x += found.step * step;
  }
  EXPECT_NEAR(x[0], 1, 1e-10);
  EXPECT_NEAR(x[1], 1, 1e-10);
  EXPECT_GT(shortened, 0);
  EXPECT_LT(steps, 30);
}

TEST(LineSearch, RefusesOptionsByName) {
  const auto field_of = [](const auto& options) {
    try {
      options.validate();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.field();
    }
    return std::string();
  };
  EXPECT_EQ(field_of(BacktrackOptions{}), "");
  EXPECT_EQ(field_of(BacktrackOptions{.shortest_step = -1e-9}), "shortest_step");
  EXPECT_EQ(field_of(BacktrackOptions{.shortest_step = kNan}), "shortest_step");
  EXPECT_EQ(field_of(BacktrackOptions{.max_trials = 0}), "max_trials");
  EXPECT_EQ(field_of(ExpandOptions{}), "");
  EXPECT_EQ(field_of(ExpandOptions{.first_step = 0}), "first_step");
  EXPECT_EQ(field_of(ExpandOptions{.longest_step = kInfinity}), "longest_step");
  EXPECT_EQ(field_of(ExpandOptions{.rounding = -1}), "rounding");
}

struct Expansion {
  double change;
  std::vector<double> tried, kept;
};
template <class F>
Expansion expanded(const ExpandOptions& options, F&& f) {
  Expansion result;
  result.change = expand(
      options,
      [&](double t) {
        result.tried.push_back(t);
        return f(t);
      },
      [&](double t) { result.kept.push_back(t); });
  return result;
}

TEST(LineSearch, ExpandsToTheFirstValley) {
  // Falls to -25 at 5, rises to 75 at 15, falls beyond.
  const auto f = [](double t) { return t < 10 ? t * (t - 10) : (t - 10) * (20 - t) * 3; };
  const Expansion found = expanded({1, 1000}, f);
  EXPECT_EQ(found.tried, (std::vector<double>{1, 2, 4, 8}));
  EXPECT_EQ(found.kept, (std::vector<double>{1, 2, 4}));
  EXPECT_EQ(found.change, -24);
}

TEST(LineSearch, PassesOverChangesWithinRoundingUntilItFalls) {
  // As from a saddle: the fall grows with the square.
  const auto f = [](double t) { return -t * t + (t < 1e-3 ? 5e-7 : 0); };
  const Expansion found = expanded({1e-4, 0.5, 1e-6}, f);
  EXPECT_EQ(found.kept.front(), 1.6e-3);
  EXPECT_LE(found.kept.back(), 0.5);
  EXPECT_GT(2 * found.kept.back(), 0.5);
  EXPECT_EQ(found.change, f(found.kept.back()));
}

TEST(LineSearch, ExpandsNowhereUphillOrWhereItMayNotGo) {
  for (const double sign : {1.0, kNan}) {
    const Expansion found = expanded({1e-4, 0.5}, [&](double t) { return sign * t; });
    EXPECT_EQ(found.change, 0);
    EXPECT_EQ(found.tried.size(), 1u);
    EXPECT_TRUE(found.kept.empty());
  }
  // A limit on the way: the last step before it is kept.
  const Expansion found = expanded({0.125, 8}, [](double t) { return t > 0.6 ? kNan : -t; });
  EXPECT_EQ(found.change, -0.5);
}

TEST(LineSearch, ExpandsNoFartherThanFlatEnergiesAreAllowedTo) {
  const Expansion found = expanded({0.25, 2, 1e-9}, [](double) { return 0.0; });
  EXPECT_EQ(found.change, 0);
  EXPECT_EQ(found.tried, (std::vector<double>{0.25, 0.5, 1, 2}));
}

}  // namespace
}  // namespace limber
