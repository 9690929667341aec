#include "tests/support/normal_chart.h"

#include <gtest/gtest.h>

#include <cmath>

namespace limber::beams {
namespace {

TEST(NormalChart, DerivativeIsThatOfTheNormal) {
  const double step = 1e-6;
  for (const auto& [x, y] : {std::pair{0.3, -0.4}, {0.0, 0.0}, {-0.9, 0.8}, {0.0, 1.5}}) {
    const Eigen::Matrix<double, 3, 2> derivative = normal_of_chart(x, y).derivative;
    const Eigen::Vector3d by_x =
        (normal_of_chart(x + step, y).normal - normal_of_chart(x - step, y).normal) / (2 * step);
    const Eigen::Vector3d by_y =
        (normal_of_chart(x, y + step).normal - normal_of_chart(x, y - step).normal) / (2 * step);
    EXPECT_LT((derivative.col(0) - by_x).norm(), 1e-9);
    EXPECT_LT((derivative.col(1) - by_y).norm(), 1e-9);
  }
}

TEST(NormalChart, NeverReachesTheLowerHemisphere) {
  for (double angle = 0; angle < 6; angle += 0.1) {
    // n_x = sin(angle) for a normal that turns about y.
    EXPECT_GE(normal_of_chart(std::sin(angle), 0).normal.z(), 0);
    EXPECT_GE(normal_of_chart(2 * std::sin(angle), 1.5).normal.z(), 0);
  }
}

TEST(NormalChart, DerivativeIsWithoutBoundAtTheEquator) {
  EXPECT_GT(normal_of_chart(1 - 1e-8, 0).derivative.norm(), 5e3);
  EXPECT_LT(normal_of_chart(0.5, 0).derivative.norm(), 2);
}

TEST(NormalChart, ARimBoundsTheDerivativeAndKeepsTheNormal) {
  const double rim = 1e-5, x = 1 - 1e-8;
  EXPECT_EQ(normal_of_chart(x, 0, rim).normal, normal_of_chart(x, 0).normal);
  EXPECT_LT(normal_of_chart(x, 0, rim).derivative.norm(), 1 / std::sqrt(rim));
  EXPECT_TRUE(normal_of_chart(1, 0, rim).derivative.allFinite());
  EXPECT_EQ(normal_of_chart(0.9, 0.1, rim).derivative, normal_of_chart(0.9, 0.1).derivative);
}

TEST(NormalChart, NothingRollsUp) {
  // A moment about y is a force of M / cos on n_x; past the equator it does no work at all.
  EXPECT_NEAR(charted_moment({0, 1, 0}, std::sin(1.0), 0).x(), 1 / std::cos(1.0), 1e-12);
  EXPECT_EQ(charted_moment({0, 1, 0}, 1.2, 0).norm(), 0);
  // Ends that have turned by 200 degrees against each other look like 160.
  const double turned = 100 * 3.14159265358979323846 / 180;
  const ChartedNormal a = normal_of_chart(-std::sin(turned), 0);
  const ChartedNormal b = normal_of_chart(std::sin(turned), 0);
  EXPECT_GT(std::acos(a.normal.dot(b.normal)), 2.7);
  EXPECT_LT(std::acos(a.normal.dot(b.normal)), 2.9);
}

}  // namespace
}  // namespace limber::beams
