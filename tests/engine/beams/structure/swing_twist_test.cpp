#include "engine/beams/structure/swing_twist.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/random.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d random_vector(Random& random, double most) {
  return {random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)};
}

double twist_of(const Quaterniond& q, int axis) { return swing_and_twist(q, axis, 0).twist; }

/// Of two twists, by less than half a turn.
double between(double a, double b) { return std::remainder(a - b, 2 * std::numbers::pi); }

TEST(SwingTwist, ARotationIsATwistAndThenASwing) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Quaterniond q = rotation_by(random_vector(random, 4));
    const int axis = i % 3;
    const SwingTwist parts = swing_and_twist(q, axis, 0);
    EXPECT_NEAR(parts.swing.vec()[axis], 0, 1e-15);
    EXPECT_LE(std::abs(parts.twist), std::numbers::pi);
    const Quaterniond again = parts.swing * twist_about(axis, parts.twist);
    EXPECT_LT(again.angularDistance(q), 1e-7);
    // Signs of quaternions mean nothing.
    Quaterniond other = q;
    other.coeffs() *= -1;
    EXPECT_NEAR(between(twist_of(other, axis), parts.twist), 0, 1e-12);
  }
}

TEST(SwingTwist, SpinsAcrossHalfOfTheSwingKeepTheTwistHoweverFarTheyGo) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Quaterniond q = rotation_by(random_vector(random, 2));
    const int axis = i % 3;
    const SwingTwist parts = swing_and_twist(q, axis, 0);
    const Vector3d along = half_of(parts.swing) * Vector3d(Vector3d::Unit(axis));
    const Vector3d across = along.cross(random_vector(random, 3));
    for (const double share : {0.1, 1.0, 2.5}) {
      const Quaterniond spun = rotation_by(share * across) * q;
      if (swing_and_twist(spun, axis, 0).swing.w() < 1e-3) continue;  // rounding is magnified there
      EXPECT_NEAR(between(twist_of(spun, axis), parts.twist), 0, 1e-11);
    }
    // About the other axis it changes by tan(t / 2) = tan(d / 2) / cos(swing / 2).
    const double d = 0.3;
    const double t = 2 * std::atan(std::tan(0.5 * d) / parts.swing.w());
    EXPECT_NEAR(between(twist_of(rotation_by(d * along) * q, axis), parts.twist + t), 0, 1e-11);
  }
}

TEST(SwingTwist, AfterHalfATurnOfSwingTheTwistIsWhatIsExpected) {
  const Quaterniond q(0, 0, 0.6, 0.8);
  for (const double expected : {0.0, 1.1}) {
    const SwingTwist parts = swing_and_twist(q, 0, expected);
    EXPECT_TRUE(parts.swings_by_half_a_turn());
    EXPECT_EQ(parts.twist, expected);
    const Quaterniond again = parts.swing * twist_about(0, expected);
    EXPECT_LT(again.angularDistance(q), 1e-7);
  }
}

}  // namespace
}  // namespace limber::beams
