#include "engine/reduced/rs_inverse.h"

#include <gtest/gtest.h>

#include "engine/base/parallel.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/rs_coordinates.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

using testing::kPi;

/// Worst entry of g(y) - G u.
double gradient_miss(const bodies::GradientOperator& gradient, const Eigen::VectorXd& y,
                     const Eigen::VectorXd& u) {
  double worst = 0;
  for (int e = 0; e < gradient.tet_count(); ++e) {
    const Eigen::Matrix3d miss = displacement_gradient(y.segment<9>(9 * e)) - gradient.apply(u, e);
    worst = std::max(worst, miss.cwiseAbs().maxCoeff());
  }
  return worst;
}

/// Largest ||theta| - angle of the twist| of a block: a turn too few or too many is 6.28. (Axes
/// differ: a tet also turns with the shear.) Tets within `margin` of a full turn are left out: all
/// logarithms of a rotation near the identity lie along its own axis, which may be across.
double largest_miss_of_angle(const bodies::ElasticBody& body, const Eigen::VectorXd& y,
                             double angle, double margin) {
  const double length = body.mesh.nodes.row(0).maxCoeff();
  double worst = 0;
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    double x = 0;
    for (int a = 0; a < 4; ++a) x += body.mesh.nodes(0, body.mesh.tets(a, e)) / 4;
    const double turned = angle * x / length;
    if (std::abs(turned) > kPi && std::abs(std::remainder(turned, 2 * kPi)) < margin) continue;
    worst = std::max(worst, std::abs(y.segment<3>(9 * e).norm() - std::abs(turned)));
  }
  return worst;
}

void expect_twist_comes_back(double angle) {
  const bodies::ElasticBody body = testing::block(24, 3, 3, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  const Eigen::VectorXd u = testing::twist(body, angle);
  const Eigen::VectorXd y = inverse.coordinates(u);
  EXPECT_LT(gradient_miss(full.gradient(), y, u), 1e-12);
  EXPECT_LT((full.from_coordinates(y) - u).norm(), 1e-9 * u.norm());
  // One branch over the whole bar: each tet's own angle, not that angle less full turns.
  EXPECT_LT(largest_miss_of_angle(body, y, angle, 0.7), 1.0);
}

TEST(RsInverse, BeamEndTwistedByOneFullTurn) { expect_twist_comes_back(2 * kPi); }
TEST(RsInverse, BeamEndTwistedByTwoFullTurns) { expect_twist_comes_back(4 * kPi); }
TEST(RsInverse, BeamEndTwistedBackwardsByTwoFullTurns) { expect_twist_comes_back(-4 * kPi); }

TEST(RsInverse, TwistGrowingToTwoTurnsLosesNoTurnInTime) {
  const bodies::ElasticBody body = testing::block(24, 2, 2, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  constexpr int kFrames = 48;
  RsTrack track;
  Eigen::VectorXd y = inverse.coordinates(Eigen::VectorXd::Zero(3 * body.mesh.node_count()), track);
  EXPECT_LT(y.norm(), 1e-12);
  for (int frame = 1; frame <= kFrames; ++frame) {
    const double angle = 4 * kPi * frame / kFrames;
    const Eigen::VectorXd u = testing::twist(body, angle);
    y = inverse.coordinates(u, track);
    ASSERT_LT((full.from_coordinates(y) - u).norm(), 1e-9 * u.norm()) << frame;
    ASSERT_LT(largest_miss_of_angle(body, y, angle, 0.7), 1.0) << frame;
  }
}

// Nothing in space tells how often a free body has turned, only the frames before: also where a
// frame is at a full turn exactly and its axis is lost in rounding.
TEST(RsInverse, FreeBodySpinningTwiceIsContinuousInTime) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, false);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -0.5).normalized();
  constexpr int kFrames = 40;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  RsTrack track;
  Eigen::VectorXd y = inverse.coordinates(rest, track);
  for (int frame = 1; frame <= kFrames; ++frame) {
    const double angle = 4 * kPi * frame / kFrames;
    const Eigen::VectorXd u =
        testing::moved(body, rest, Eigen::AngleAxisd(angle, axis).toRotationMatrix(),
                       Eigen::Vector3d(3, -2, 0.01 * frame));
    y = inverse.coordinates(u, track);
    EXPECT_LT(gradient_miss(gradient, y, u), 1e-9);
    for (int e = 0; e < body.mesh.tet_count(); ++e) {
      ASSERT_LT((y.segment<3>(9 * e) - angle * axis).norm(), 1e-6)
          << "frame " << frame << " tet " << e << ": " << y.segment<3>(9 * e).transpose();
      ASSERT_LT(y.segment<6>(9 * e + 3).norm(), 1e-11);
    }
  }
}

// The frames next to a full turn have stray axes, all tets at once: the turn must be found again
// beyond, forth and back.
TEST(RsInverse, SpinningAndWobblingFreeBodyLosesNoTurnInTime) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, false);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  for (const double wobble : {0.0, 0.01, 0.05, 0.2}) {
    for (const double step : {0.05, 0.1, 0.31, 1.0, 2.0}) {
      RsTrack track;
      const int frames = static_cast<int>(std::lround(20 / step));
      int judged = 0;
      double worst = 0;
      for (int frame = 0; frame <= 2 * frames + 3 / step; ++frame) {
        const double angle = step * (frames - std::abs(frame - frames));  // to 20, to -3
        const Eigen::VectorXd u = testing::spun(body, angle, wobble);
        const Eigen::VectorXd y = inverse.coordinates(u, track);
        EXPECT_LT(gradient_miss(gradient, y, u), 1e-12);
        if (std::abs(angle) > kPi && std::abs(std::remainder(angle, 2 * kPi)) < 1.5) continue;
        ++judged;
        for (int e = 0; e < body.mesh.tet_count(); ++e) {
          const double turned = std::copysign(y.segment<3>(9 * e).norm(), y[9 * e + 2]);
          worst = std::max(worst, std::abs(turned - angle));
        }
      }
      EXPECT_GT(judged, frames / 2);
      EXPECT_LT(worst, 1.5 * wobble + 1e-9) << "wobble " << wobble << " step " << step;
    }
  }
}

// The wobble goes round 400 times at a full turn: steps between frames would add up to its cone's
// solid angle, more than a turn.
TEST(RsInverse, WobbleThatStaysNextToAFullTurnIsNotCounted) {
  const bodies::ElasticBody body = testing::block(2, 1, 1, 0.1, false);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  RsTrack track;
  Eigen::VectorXd y;
  for (double angle = 0; angle < 2 * kPi; angle += 0.25) {
    y = inverse.coordinates(testing::spun(body, angle, 0), track);
  }
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  for (int frame = 0; frame < 400 * 16; ++frame) {
    const Eigen::Vector3d side(std::cos(frame * kPi / 8), std::sin(frame * kPi / 8), 0);
    const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.2, side).toRotationMatrix();
    const Eigen::VectorXd u = testing::moved(body, rest, tilt, Eigen::Vector3d::Zero());
    y = inverse.coordinates(u, track);
    ASSERT_LT(gradient_miss(gradient, y, u), 1e-12);
  }
  y = inverse.coordinates(testing::spun(body, 7.5, 0), track);
  for (int e = 0; e < body.mesh.tet_count(); ++e) EXPECT_NEAR(7.5, y[9 * e + 2], 1e-9);
}

TEST(RsInverse, SmallDisplacementsHaveTheirLinearCoordinates) {
  const bodies::ElasticBody body = testing::block(6, 3, 3, 0.1, true);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  const Eigen::VectorXd field = testing::smooth_field(body, 0.3, 11);
  double last = 0;
  for (const double size : {1e-2, 1e-3, 1e-4}) {
    const Eigen::VectorXd u = size * field;
    const Eigen::VectorXd miss = inverse.coordinates(u) - linear_coordinates(gradient, u);
    const double relative = miss.norm() / linear_coordinates(gradient, u).norm();
    EXPECT_LT(relative, 2 * size);
    if (last > 0) {
      EXPECT_NEAR(last / relative, 10, 1);  // of second order
    }
    last = relative;
  }
  EXPECT_GT(last, 1e-9);
}

TEST(RsInverse, RotationsOfTheWholeOnlyTurnTheRotations) {
  const bodies::ElasticBody body = testing::block(5, 3, 3, 0.1, false);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  const Eigen::VectorXd u = testing::smooth_field(body, 0.15, 12);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2.2, Eigen::Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  const Eigen::VectorXd y = inverse.coordinates(u),
                        turned = inverse.coordinates(testing::moved(body, u, turn, {1, 2, 3}));
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    EXPECT_LT((y.segment<6>(9 * e + 3) - turned.segment<6>(9 * e + 3)).norm(), 1e-12);
  }
  EXPECT_LT(gradient_miss(gradient, turned, testing::moved(body, u, turn, {1, 2, 3})), 1e-12);
}

TEST(RsInverse, InvertedAndFlatTetsStillComeBack) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  Eigen::VectorXd u = testing::smooth_field(body, 0.2, 13);
  u.segment<3>(3 * (body.mesh.node_count() - 5)) += Eigen::Vector3d(-0.31, 0.12, 0.2);
  bool inverted = false;
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    inverted |= (full.gradient().apply(u, e) + Eigen::Matrix3d::Identity()).determinant() < -0.1;
  }
  ASSERT_TRUE(inverted);
  const Eigen::VectorXd y = inverse.coordinates(u);
  ASSERT_TRUE(y.allFinite());
  EXPECT_LT(gradient_miss(full.gradient(), y, u), 1e-12);
  EXPECT_LT((full.from_coordinates(y) - u).norm(), 1e-9 * u.norm());

  // All in one plane: a stretch of zero, the worst case of a polar decomposition.
  Eigen::Matrix3Xd flat = body.mesh.nodes;
  flat.row(2).setZero();
  const Eigen::VectorXd squashed = testing::displacements(body, flat);
  const Eigen::VectorXd y_flat = inverse.coordinates(squashed);
  ASSERT_TRUE(y_flat.allFinite());
  EXPECT_LT(gradient_miss(full.gradient(), y_flat, squashed), 1e-12);
}

TEST(RsInverse, DoesNotDependOnTheThreads) {
  const bodies::ElasticBody body = testing::block(16, 4, 4, 0.1, true);
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  const int before = thread_count();
  RsTrack track_of_one, track_of_three;
  for (double angle = 5; angle < 9; angle += 0.5) {
    const Eigen::VectorXd u = testing::twist(body, angle);
    set_thread_count(1);
    const Eigen::VectorXd one = inverse.coordinates(u, track_of_one);
    set_thread_count(3);
    const Eigen::VectorXd three = inverse.coordinates(u, track_of_three);
    set_thread_count(before);
    EXPECT_EQ(one, three);
    EXPECT_EQ(track_of_one.counted, track_of_three.counted);
  }
}

}  // namespace
}  // namespace limber::reduced
