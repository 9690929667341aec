#include "engine/base/rotations/angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace limber::rotations {
namespace {

TEST(RotationsAngles, CosineAndSineAgreeWithTheLibrary) {
  for (int i = -4000; i <= 4000; ++i) {
    const double angle = i / 97.0;
    const auto k = cosine_sine(angle);
    EXPECT_NEAR(k.cosine, std::cos(angle), 4e-16) << angle;
    EXPECT_NEAR(k.sine, std::sin(angle), 4e-16) << angle;
  }
}

TEST(RotationsAngles, AngleOfAVectorAgreesWithTheLibrary) {
  for (int i = -3600; i <= 3600; ++i) {
    const double angle = std::numbers::pi * i / 3600;
    for (const double length : {1e-9, 1.0, 1e9}) {
      const double c = length * std::cos(angle), s = length * std::sin(angle);
      const double expected = std::atan2(s, c);
      EXPECT_NEAR(angle_of(c, s), expected, 4.5e-16 * std::max(std::abs(expected), 1e-30)) << angle;
    }
  }
  for (const double tiny : {1e-3, 1e-9, 1e-200}) EXPECT_NEAR(angle_of(1.0, tiny) / tiny, 1, 1e-6);
  EXPECT_TRUE(std::isnan(angle_of(0.0, 0.0)));
}

TEST(RotationsAngles, PacksAgreeWithScalars) {
  using V = Pack<double>;
  const V angle([](auto i) { return 1.7 * double(i) - 2.5; });
  const auto k = cosine_sine(angle);
  const V back = angle_of(3.0 * k.cosine, 3.0 * k.sine);
  for (int lane = 0; lane < static_cast<int>(V::size()); ++lane) {
    EXPECT_NEAR(k.sine[lane], std::sin(1.7 * lane - 2.5), 1e-15);
    EXPECT_NEAR(back[lane], std::remainder(1.7 * lane - 2.5, 2 * std::numbers::pi), 1e-15);
  }
}

TEST(RotationsAngles, DerivativesTravelWithTheValue) {
  const Dual<double> angle(0.7, 2.0);
  const auto k = cosine_sine(angle);
  EXPECT_NEAR(k.cosine.derivative, -2 * std::sin(0.7), 1e-15);
  EXPECT_NEAR(k.sine.derivative, 2 * std::cos(0.7), 1e-15);
  const Dual<double> length(3.0, 5.0);  // does not move the angle
  const Dual<double> back = angle_of(length * k.cosine, length * k.sine);
  EXPECT_NEAR(back.value, 0.7, 1e-15);
  EXPECT_NEAR(back.derivative, 2.0, 1e-14);
}

TEST(RotationsAngles, NearestTurnKeepsAnAngleContinuousPastPi) {
  EXPECT_NEAR(nearest_turn(-3.1, 3.1), 2 * std::numbers::pi - 3.1, 1e-15);
  EXPECT_NEAR(nearest_turn(0.2, 40.0), 0.2 + 12 * std::numbers::pi, 1e-14);
  EXPECT_EQ(nearest_turn(0.2, 0.1), 0.2);
}

}  // namespace
}  // namespace limber::rotations
