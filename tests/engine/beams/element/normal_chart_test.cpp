#include "engine/beams/element/normal_chart.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/rotations/exponential_map.h"
#include "engine/beams/element/element_energy.h"
#include "tests/support/energy_conformance.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;

ChartedElement element() { return {0.5, 40, 0.7, 1.3}; }

ChartedVector unknowns() {
  ChartedVector u;
  u << 0.1, -0.2, 0.3, 0.15, -0.1, 0.55, -0.1, 0.4, -0.2, 0.25;
  return u;
}

TEST(NormalChart, ElementConformsInsideAndOutsideTheDisc) {
  limber::testing::EnergyUnderTest energy;
  energy.value = [](const Eigen::VectorXd& u) { return charted_energy(element(), u); };
  energy.gradient = [](const Eigen::VectorXd& u) -> Eigen::VectorXd {
    return charted_gradient(element(), u);
  };
  limber::testing::expect_conforms(energy, unknowns());
  ChartedVector outside = unknowns();
  outside[8] = -0.9;
  outside[9] = 0.8;
  limber::testing::expect_conforms(energy, outside);
}

TEST(NormalChart, AgreesWithTheFramesWhereAnglesAreSmall) {
  // An element along x that bends about axis 2: the same energy to the square of the angles.
  const double a = 0.02, b = -0.03;
  ChartedVector u = ChartedVector::Zero();
  u[3] = std::sin(a);
  u[5] = 0.5;
  u[8] = std::sin(b);
  ElementConstants<double> k;
  k.length = 0.5;
  k.near_2 = 4 * 1.3 / 0.5, k.far_2 = 2 * 1.3 / 0.5;
  ElementEnds ends;
  ends.start = Vector3d::Zero();
  ends.finish = Vector3d(0.5, 0, 0);
  ends.start_axes = rotations::exponential({0, a, 0});
  ends.finish_axes = rotations::exponential({0, b, 0});
  const double frames = element_energies(k, ends).total();
  EXPECT_NEAR(charted_energy(element(), u), frames, 1e-3 * frames);
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

TEST(NormalChart, NothingRollsUp) {
  // A moment about y is a force of M / cos on n_x; past the equator it does no work at all.
  EXPECT_NEAR(charted_moment({0, 1, 0}, std::sin(1.0), 0).x(), 1 / std::cos(1.0), 1e-12);
  EXPECT_EQ(charted_moment({0, 1, 0}, 1.2, 0).norm(), 0);
  // Ends that have turned by 200 degrees against each other look like 160.
  ChartedVector u = ChartedVector::Zero();
  u[5] = 0.5;
  const double turned = 100 * 3.14159265358979323846 / 180;
  u[3] = -std::sin(turned);
  u[8] = std::sin(turned);
  const ChartedNormal a = normal_of_chart(u[3], 0), b = normal_of_chart(u[8], 0);
  EXPECT_GT(std::acos(a.normal.dot(b.normal)), 2.7);
  EXPECT_LT(std::acos(a.normal.dot(b.normal)), 2.9);
}

}  // namespace
}  // namespace limber::beams
