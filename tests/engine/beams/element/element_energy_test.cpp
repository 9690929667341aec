#include "engine/beams/element/element_energy.h"

#include <gtest/gtest.h>

#include "tests/engine/beams/element/element_charts.h"

namespace limber::beams {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A strip with all constants different, half a length unit long.
ElementConstants<double> strip() {
  ElementConstants<double> k;
  k.length = 0.5;
  k.stretching = 40;
  k.torsion = 0.7;
  k.near_2 = 4 * 1.3, k.far_2 = 2 * 1.3;
  k.near_3 = 4 * 0.4, k.far_3 = 2 * 0.4;
  k.bow = k.length / 30;
  return k;
}

struct Attitude {
  Matrix3d frame;          // of the element
  Vector3d start, finish;  // rotation vectors of the ends against it
  double chord;
};

ElementEnds ends_of(const Attitude& at) {
  ElementEnds ends;
  ends.start = Vector3d(0.3, -0.2, 0.5);
  ends.finish = ends.start + at.chord * at.frame.col(0);
  ends.start_axes = rotations::exponential(at.start) * at.frame;
  ends.finish_axes = rotations::exponential(at.finish) * at.frame;
  return ends;
}

Eigen::VectorXd unknowns_at(const ElementEnds& ends) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
  x.segment<3>(0) = ends.start;
  x.segment<3>(6) = ends.finish;
  return x;
}

class ElementConforms : public ::testing::TestWithParam<Attitude> {};

TEST_P(ElementConforms, InEveryAttitude) {
  const ElementEnds ends = ends_of(GetParam());
  const auto energy = testing::element_energy(strip(), ends);
  limber::testing::expect_conforms(energy, unknowns_at(ends));
}

const Matrix3d kTilted = rotations::exponential({0.7, -1.1, 0.4});
const Matrix3d kUpsideDown = rotations::exponential({3.1, 0.2, -0.1});

INSTANTIATE_TEST_SUITE_P(
    Attitudes, ElementConforms,
    ::testing::Values(Attitude{Matrix3d::Identity(), {0.1, 0.2, -0.3}, {-0.2, 0.1, 0.4}, 0.52},
                      Attitude{kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.47},
                      Attitude{kUpsideDown, {0.02, -0.01, 0.03}, {-0.01, 0.02, 0.015}, 0.5001},
                      Attitude{kTilted, {1.2, 1.0, -0.4}, {-0.3, -1.3, 0.9}, 0.6},
                      Attitude{Matrix3d::Identity(), {-1.4, 0.2, 0.1}, {1.5, -0.1, 0.3}, 0.52}),
    [](const auto& test) { return "Attitude" + std::to_string(test.index); });

TEST(BeamElementEnergy, DoesNotChangeInRigidMotions) {
  const ElementEnds ends = ends_of({kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.47});
  const Matrix3d turn = rotations::exponential({0.4, 2.1, -0.9});
  ElementEnds moved;
  moved.start = turn * ends.start + Vector3d(2, -1, 0.4);
  moved.finish = turn * ends.finish + Vector3d(2, -1, 0.4);
  moved.start_axes = turn * ends.start_axes;
  moved.finish_axes = turn * ends.finish_axes;
  const double energy = element_energies(strip(), ends).total();
  EXPECT_GT(energy, 0.1);
  EXPECT_NEAR(element_energies(strip(), moved).total(), energy, 1e-13 * energy);
}

TEST(BeamElementEnergy, IsZeroAtRestInEveryAttitude) {
  for (const Matrix3d& frame : {Matrix3d(Matrix3d::Identity()), kTilted, kUpsideDown}) {
    const ElementEnds ends = ends_of({frame, Vector3d::Zero(), Vector3d::Zero(), 0.5});
    EXPECT_LT(element_energies(strip(), ends).total(), 1e-28);
    EXPECT_LT(element_gradient(strip(), ends).norm(), 1e-13);
  }
}

TEST(BeamElementEnergy, OfPureModesIsThatOfTheBeam) {
  const auto k = strip();
  // Twist, bending about both axes into an arc, and stretch: U = stiffness angle^2 / 2.
  const double angle = 0.1;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d half = 0.5 * angle * Vector3d::Unit(axis);
    const double chord = axis == 0 ? 0.5 : 0.5 * std::sin(0.5 * angle) / (0.5 * angle);
    const ElementEnds ends = ends_of({kTilted, -(kTilted * half), kTilted * half, chord});
    const double stiffness = axis == 0 ? 0.7 : axis == 1 ? 1.3 : 0.4;
    EXPECT_NEAR(element_energies(k, ends).total(), 0.5 * stiffness * angle * angle,
                2e-6 * stiffness * angle * angle)
        << axis;
  }
  const ElementEnds pulled = ends_of({kTilted, Vector3d::Zero(), Vector3d::Zero(), 0.51});
  EXPECT_NEAR(element_energies(k, pulled).total(), 0.5 * 40 * 1e-4, 1e-14);
}

TEST(BeamElementEnergy, TorqueIsLinearWithin_0_2_PercentToOneRadian) {
  for (const double angle : {-3.0, -1.0, 0.25, 1.0, 2.0, 2.6}) {
    const Vector3d half = 0.5 * angle * Vector3d::UnitX();
    const ElementEnds ends = ends_of({Matrix3d::Identity(), -half, half, 0.5});
    EXPECT_NEAR(twist_angle(strip(), ends), angle, 1e-14);
    const double torque = element_gradient(strip(), ends)[9] / 0.7;
    const double fourth = std::pow(angle, 4);
    EXPECT_LT(std::abs(torque - angle),
              std::abs(angle) * fourth / (std::abs(angle) > 1 ? 300 : 450))
        << angle;
    EXPECT_GT(torque * angle, 0);
  }
}

TEST(BeamElementEnergy, OfAnElementThatIsCurvedAndTwistedAtRest) {
  auto k = strip();
  k.rest_angle_2 = 0.08;
  k.rest_angle_3 = -0.05;
  k.rest_twist = 0.11;
  const ElementEnds straight = ends_of({kTilted, Vector3d::Zero(), Vector3d::Zero(), 0.5});
  EXPECT_GT(element_energies(k, straight).total(), 1e-3);
  const ElementEnds ends = ends_of({kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.47});
  limber::testing::expect_conforms(testing::element_energy(k, ends), unknowns_at(ends));
}

TEST(BeamElementEnergy, OfReleasedShearAndOfCables) {
  auto k = strip();
  k.near_2 = 1.3, k.far_2 = -1.3;
  const ElementEnds ends = ends_of({kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.47});
  limber::testing::expect_conforms(testing::element_energy(k, ends), unknowns_at(ends));
  ElementConstants<double> cable;
  cable.length = 0.5;
  cable.stretching = 40;
  cable.least_stretch = 0;
  const ElementEnds taut = ends_of({kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.56});
  limber::testing::expect_conforms(testing::element_energy(cable, taut), unknowns_at(taut));
  const ElementEnds slack = ends_of({kTilted, {0.5, -0.7, 0.6}, {-0.4, 0.8, 0.3}, 0.47});
  EXPECT_EQ(element_energies(cable, slack).total(), 0);
  EXPECT_EQ(element_gradient(cable, slack).norm(), 0);
  EXPECT_EQ(element_hessian(cable, slack).norm(), 0);
}

}  // namespace
}  // namespace limber::beams
