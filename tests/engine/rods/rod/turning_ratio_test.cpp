#include "engine/rods/rod/turning_ratio.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/single_rod.h"

namespace limber::rods {
namespace {

/// The derivative of atan(sqrt x) / sqrt x as the integral of s^(2 n) (-1)^n n! / (1 + x s^2)^(n+1)
/// over [0, 1], by Simpson's rule.
double by_integral(int derivative, double x) {
  constexpr int kIntervals = 20000;
  const auto integrand = [&](long double s) {
    long double value = 1 / (1 + x * s * s);
    for (int k = 1; k <= derivative; ++k) value *= -k * s * s / (1 + x * s * s);
    return value;
  };
  long double sum = integrand(0) + integrand(1);
  for (int i = 1; i < kIntervals; ++i)
    sum += (i % 2 == 1 ? 4 : 2) * integrand(static_cast<long double>(i) / kIntervals);
  return static_cast<double>(sum / (3 * kIntervals));
}

TEST(TurningRatio, AndItsDerivativesAreTheIntegrals) {
  for (const double x : {0.0, 1e-30, 1e-9, 1e-3, 0.1, 0.3333, 0.3334, 0.5, 1.0, 4.0, 100.0}) {
    const double computed[] = {turning_ratio<0>(x), turning_ratio<1>(x), turning_ratio<2>(x),
                               turning_ratio<3>(x), turning_ratio<4>(x)};
    const double tolerances[] = {2e-15, 4e-15, 2e-14, 1e-13, 1e-12};
    for (int n = 0; n <= 4; ++n) {
      const double expected = by_integral(n, x);
      EXPECT_NEAR(computed[n], expected, tolerances[n] * std::abs(expected)) << n << " " << x;
    }
  }
}

TEST(TurningRatio, TurnsTangentsIntoAngles) {
  for (const double angle : {1e-8, 1e-3, 0.5, 1.0, 1.1, 2.0, 3.0, 3.14159, 3.14159265}) {
    const double tangent = std::tan(angle / 2);
    EXPECT_NEAR(2 * tangent * turning_ratio<0>(tangent * tangent), angle, 1e-15 * angle);
  }
}

TEST(TurningRatio, BendsEdgesByTheirAngleUntilTheyAllButFoldBack) {
  for (const double angle : {0.1, 1.0, 2.0, 3.0, 3.14, 3.1415926}) {
    Eigen::Matrix3Xd nodes(3, 3);
    nodes << -1, 0, std::cos(angle), 0, 0, std::sin(angle), 0, 0, 0;
    const Rod rod(nodes, {100, 2, 2, 1},
                  {.rest = RestShape::kStraight, .form = BendingForm::kTurningAngle});
    const RodState state = RodAtSource(rod.drawn).state();
    EXPECT_NEAR(state.energy(rod.parameters), angle * angle, 1e-8 * angle);
    // The force that turns the last edge is E' over its length.
    const Eigen::Vector3d force = state.gradient(rod.parameters).segment<3>(8);
    const Eigen::Vector3d across(-std::sin(angle), std::cos(angle), 0);
    EXPECT_LT((force - 2 * angle * across).norm(), 1e-7 * angle);
  }
}

}  // namespace
}  // namespace limber::rods
