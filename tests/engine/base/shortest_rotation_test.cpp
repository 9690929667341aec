#include "engine/base/rotations/shortest_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/random.h"

namespace limber::rotations {
namespace {

/// It takes the one to the other, is of unit norm and turns by the angle between them.
void expect_shortest(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double angle) {
  const Eigen::Quaterniond q = shortest_rotation(from, to);
  EXPECT_NEAR(q.norm(), 1, 1e-12);
  EXPECT_LE((q * from.normalized() - to.normalized()).norm(), 1e-7);
  EXPECT_NEAR(2 * std::atan2(q.vec().norm(), q.w()), angle, 1e-6);
}

TEST(ShortestRotation, TurnsByTheAngleBetweenDirections) {
  expect_shortest({1, 0, 0}, {0, 2, 0}, std::numbers::pi / 2);
  const Eigen::Quaterniond q = shortest_rotation({1, 0, 0}, {0, 5, 0});
  EXPECT_NEAR(q.z(), std::sqrt(0.5), 1e-15);
  Random random(9);
  for (int run = 0; run < 200; ++run) {
    const auto vector = [&] {
      return Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    };
    const Eigen::Vector3d from = 1e3 * vector(), to = 1e-3 * vector();
    expect_shortest(from, to, std::atan2(from.cross(to).norm(), from.dot(to)));
  }
}

TEST(ShortestRotation, OfEqualDirectionsIsNone) {
  const Eigen::Quaterniond q = shortest_rotation({1, 2, 3}, {2, 4, 6});
  EXPECT_NEAR(q.w(), 1, 1e-15);
  EXPECT_LE(q.vec().norm(), 1e-15);
}

TEST(ShortestRotation, OfOppositeDirectionsIsHalfATurn) {
  for (const Eigen::Vector3d& from :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, -3), Eigen::Vector3d(1, -2, 0.5)})
    expect_shortest(from, -from, std::numbers::pi);
}

/// The cosine alone says little of an angle close to half a turn: fewer digits are left, not none,
/// also where another formula takes over (at 1.4e-6).
TEST(ShortestRotation, CloseToOppositeDirectionsNothingJumps) {
  const Eigen::Vector3d from(1, 0, 0);
  for (const double angle : {1e-3, 1e-5, 2e-6, 1.5e-6, 1.4e-6, 1e-6, 1e-8, 1e-12}) {
    const Eigen::Vector3d to(-std::cos(angle), std::sin(angle), 0);
    const Eigen::Quaterniond q = shortest_rotation(from, to);
    EXPECT_NEAR(q.norm(), 1, 2e-4) << angle;
    EXPECT_LE((q.normalized() * from - to).norm(), 2e-4) << angle;
  }
}

}  // namespace
}  // namespace limber::rotations
