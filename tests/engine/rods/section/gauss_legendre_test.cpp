#include "engine/rods/section/gauss_legendre.h"

#include <gtest/gtest.h>

#include <cmath>

namespace limber::rods {
namespace {

double integral_of_power(const GaussLegendre& rule, int power) {
  double sum = 0;
  for (std::size_t i = 0; i < rule.points.size(); ++i)
    sum += rule.weights[i] * std::pow(rule.points[i], power);
  return sum;
}

TEST(GaussLegendre, IsExactForPowersUpToTwiceItsPoints) {
  for (int n = 1; n <= 12; ++n) {
    const GaussLegendre rule = gauss_legendre(n);
    ASSERT_EQ(rule.points.size(), static_cast<std::size_t>(n));
    for (int power = 0; power < 2 * n; ++power)
      EXPECT_NEAR(integral_of_power(rule, power), 1.0 / (power + 1), 1e-14)
          << n << " points, power " << power;
  }
}

TEST(GaussLegendre, IsNotExactForTheNextPower) {
  for (int n = 1; n <= 4; ++n)
    EXPECT_GT(std::abs(integral_of_power(gauss_legendre(n), 2 * n) - 1.0 / (2 * n + 1)), 1e-6);
}

TEST(GaussLegendre, PointsAscendWithinTheIntervalAndAreSymmetric) {
  const GaussLegendre rule = gauss_legendre(9);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_GT(rule.points[i], i == 0 ? 0 : rule.points[i - 1]);
    EXPECT_NEAR(rule.points[i] + rule.points[8 - i], 1, 1e-15);
    EXPECT_NEAR(rule.weights[i], rule.weights[8 - i], 1e-15);
  }
  EXPECT_NEAR(gauss_legendre(2).points[0], 0.5 - std::sqrt(1.0 / 12), 1e-15);
}

}  // namespace
}  // namespace limber::rods
