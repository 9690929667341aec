#include "engine/beams/element/spread_load.h"

#include <gtest/gtest.h>

#include "tests/engine/beams/element/element_charts.h"

namespace limber::beams {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLength = 0.8;

/// Of an element far from straight and from its axes.
ElementEnds bent_ends() {
  const Matrix3d frame = rotations::exponential({0.7, -1.1, 0.4});
  ElementEnds ends;
  ends.start = Vector3d(0.3, -0.2, 0.5);
  ends.finish = ends.start + 0.7 * frame.col(0);
  ends.start_axes = rotations::exponential({0.4, -0.5, 0.6}) * frame;
  ends.finish_axes = rotations::exponential({-0.3, 0.7, 0.2}) * frame;
  return ends;
}

LoadTransfer transfer_with(Carrier axial, Carrier shear_2, Carrier shear_3) {
  return {kLength, {axial, shear_2, shear_3}};
}

const LoadTransfer kTransfers[] = {transfer_with(Carrier::kBoth, Carrier::kBoth, Carrier::kBoth),
                                   transfer_with(Carrier::kStart, Carrier::kBoth, Carrier::kBoth),
                                   transfer_with(Carrier::kBoth, Carrier::kFinish, Carrier::kBoth),
                                   transfer_with(Carrier::kFinish, Carrier::kBoth, Carrier::kStart),
                                   {0, {Carrier::kBoth, Carrier::kBoth, Carrier::kBoth}}};

TEST(SpreadLoad, HasAPotentialThatConforms) {
  const Vector3d load(3, -2, 5);
  for (const LoadTransfer& transfer : kTransfers) {
    if (transfer.lever == 0) continue;  // linear in positions: no second derivatives
    const ElementEnds ends = bent_ends();
    const auto potential = testing::energy_of_ends(
        ends, [&](const ElementEnds& at) { return spread_potential(transfer, at, load); },
        [&](const ElementEnds& at) -> ElementVector {
          return -spread_forces(transfer, at, {load, load});
        },
        [&](const ElementEnds& at) { return spread_hessian(transfer, at, load); });
    Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
    x.segment<3>(0) = ends.start;
    x.segment<3>(6) = ends.finish;
    limber::testing::expect_conforms(potential, x);
  }
}

TEST(SpreadLoad, DerivativeOfALoadThatFollowsIsThatOfItsForces) {
  const ElementEnds ends = bent_ends();
  const SpreadLoad load{{3, -2, 5}, {1, 4, -2}};
  for (const LoadTransfer& transfer : kTransfers) {
    const ElementMatrix derivative = following_derivative(transfer, ends, load);
    for (int i = 0; i < 12; ++i) {
      const auto forces = [&](double step) {
        Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
        x.segment<3>(0) = ends.start;
        x.segment<3>(6) = ends.finish;
        x[i] += step;
        const SpreadLoad turned{rotations::exponential(x.segment<3>(3)) * load.start,
                                rotations::exponential(x.segment<3>(9)) * load.finish};
        return spread_forces(transfer, testing::ends_at(ends, x), turned);
      };
      const ElementVector difference = (forces(1e-6) - forces(-1e-6)) / 2e-6;
      EXPECT_LT((difference - derivative.col(i)).norm(), 1e-8) << i;
    }
  }
}

TEST(SpreadLoad, OnStraightElementsTheFixedEndForces) {
  ElementEnds ends;
  ends.start = Vector3d::Zero();
  ends.finish = Vector3d(kLength, 0, 0);
  ends.start_axes = ends.finish_axes = Matrix3d::Identity();
  const double q = 6;  // resultant, along axis 3
  const SpreadLoad load{{0, 0, q}, {0, 0, q}};
  const auto forces = [&](const LoadTransfer& transfer) {
    return spread_forces(transfer, ends, load);
  };
  // Clamped: q L / 12; moments about axis 2, down at the start and up at the finish.
  ElementVector expected;
  expected << 0, 0, q / 2, 0, -q * kLength / 12, 0, 0, 0, q / 2, 0, q * kLength / 12, 0;
  EXPECT_LT((forces(kTransfers[0]) - expected).norm(), 1e-14);
  // Guided at the finish: q L / 3 and q L / 6, and the start carries all.
  expected << 0, 0, q, 0, -q * kLength / 3, 0, 0, 0, 0, 0, -q * kLength / 6, 0;
  const LoadTransfer guided = transfer_with(Carrier::kBoth, Carrier::kBoth, Carrier::kStart);
  EXPECT_LT((forces(guided) - expected).norm(), 1e-14);
  // Along the axis, free at the start.
  const SpreadLoad along{{q, 0, 0}, {q, 0, 0}};
  const LoadTransfer slides = transfer_with(Carrier::kFinish, Carrier::kBoth, Carrier::kBoth);
  expected.setZero();
  expected[6] = q;
  EXPECT_LT((spread_forces(slides, ends, along) - expected).norm(), 1e-14);
}

/// Forces and moments on the ends are those of the load where the cubic is.
TEST(SpreadLoad, HasTheResultantOfTheLoad) {
  const ElementEnds ends = bent_ends();
  const SpreadLoad load{{3, -2, 5}, {1, 4, -2}};
  const ElementVector forces = spread_forces(kTransfers[0], ends, load);
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  const int count = 2000;
  for (int i = 0; i < count; ++i) {
    const double s = (i + 0.5) / count, s2 = s * s, s3 = s2 * s;
    const Vector3d place = (1 - 3 * s2 + 2 * s3) * ends.start + (3 * s2 - 2 * s3) * ends.finish +
                           kLength * ((s - 2 * s2 + s3) * ends.start_axes.col(0) +
                                      (s3 - s2) * ends.finish_axes.col(0));
    const Vector3d here = ((1 - s) * load.start + s * load.finish) / count;
    force += here;
    moment += place.cross(here);
  }
  EXPECT_LT((forces.segment<3>(0) + forces.segment<3>(6) - force).norm(), 1e-12);
  const Vector3d on_ends = ends.start.cross(Vector3d(forces.segment<3>(0))) +
                           ends.finish.cross(Vector3d(forces.segment<3>(6))) +
                           forces.segment<3>(3) + forces.segment<3>(9);
  EXPECT_LT((on_ends - moment).norm(), 1e-6);
}

}  // namespace
}  // namespace limber::beams
