#include "engine/rods/equilibrium/prediction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace limber::rods::detail {
namespace {

Eigen::VectorXd one(double x) { return Eigen::VectorXd::Constant(1, x); }

/// Follows x(t) in steps, with or without velocities, and says where it goes from there.
template <class Place, class Velocity>
double predicted(const Place& x, const Velocity& v, bool velocities) {
  Prediction prediction(2);
  double t = 0.3;
  for (const double length : {0.1, 0.25}) {
    prediction.add(length, one(x(t + length) - x(t)), {},
                   velocities ? one(v(t + length)) : Eigen::VectorXd());
    t += length;
  }
  return x(t) + prediction.over(0.2)[0] - x(t + 0.2);
}

TEST(Prediction, OfACubicWithVelocitiesIsExact) {
  const auto x = [](double t) { return 1 + t - 3 * t * t + 2 * t * t * t; };
  const auto v = [](double t) { return 1 - 6 * t + 6 * t * t; };
  EXPECT_NEAR(predicted(x, v, true), 0, 1e-14);
  EXPECT_GT(std::abs(predicted(x, v, false)), 1e-2);
}

TEST(Prediction, OfALineNeedsNoVelocities) {
  const auto x = [](double t) { return 2 - 5 * t; };
  EXPECT_NEAR(predicted(x, x, false), 0, 1e-14);
}

TEST(Prediction, TakesPlacesFromWhereTheyShouldHaveEnded) {
  Prediction prediction(2);
  prediction.add(1, one(1.01), one(-0.01), one(1));
  EXPECT_FALSE(prediction.possible());
  prediction.add(1, one(1.01), one(-0.02), one(1));
  ASSERT_TRUE(prediction.possible());
  EXPECT_NEAR(prediction.over(1)[0], 1 - 0.02, 1e-14);
  EXPECT_NEAR(prediction.straight(0.5)[0], 0.5 - 0.02, 1e-14);
}

TEST(Prediction, IsForgotten) {
  Prediction prediction(2);
  prediction.add(1, one(1), {}, one(1));
  prediction.add(1, one(1), {}, one(1));
  prediction.clear();
  EXPECT_FALSE(prediction.possible());
}

}  // namespace
}  // namespace limber::rods::detail
