#include "engine/base/rotations/logarithm.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>
#include <random>

#include "engine/base/rotations/exponential_map.h"

namespace limber::rotations {
namespace {

Eigen::Vector3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

Eigen::Quaterniond turn(const Eigen::Vector3d& theta) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(theta.norm(), theta.normalized()));
}

TEST(RotationsLogarithm, InvertsTheExponential) {
  std::mt19937_64 random(1);
  for (double angle : {1e-12, 1e-8, 1e-4, 0.1, 1.0, 2.0, 3.0, 3.14, std::numbers::pi - 1e-9}) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d theta = angle * random_direction(random);
      EXPECT_LT((logarithm(exponential(theta)) - theta).norm(), 1e-14) << angle;
      EXPECT_LT((logarithm(turn(theta)) - theta).norm(), 1e-15 + 1e-15 * angle) << angle;
    }
  }
  EXPECT_EQ(0, logarithm(Eigen::Matrix3d(Eigen::Matrix3d::Identity())).norm());
}

TEST(RotationsLogarithm, HalfTurnGivesOneOfTheTwoAxes) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d axis = random_direction(random);
    const Eigen::Matrix3d half = 2 * axis * axis.transpose() - Eigen::Matrix3d::Identity();
    const Eigen::Vector3d theta = logarithm(half);
    EXPECT_NEAR(theta.norm(), std::numbers::pi, 1e-14);
    EXPECT_LT((exponential(theta) - half).norm(), 1e-14);
  }
}

TEST(RotationsLogarithm, NearestBranchFollowsATwistThroughManyTurns) {
  std::mt19937_64 random(3);
  const Eigen::Vector3d axis = random_direction(random);
  Eigen::Vector3d theta = Eigen::Vector3d::Zero();
  for (int i = 1; i <= 400; ++i) {
    const Eigen::Vector3d expected = -0.083 * i * axis;  // past -10 pi
    theta = logarithm_near(turn(expected), theta);
    ASSERT_LT((theta - expected).norm(), 1e-12) << i;
  }
}

TEST(RotationsLogarithm, NearestBranchIsNearestOfAll) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> length(0, 15);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d theta = 3.1 * random_direction(random);
    const Eigen::Vector3d reference = length(random) * random_direction(random);
    const Eigen::Vector3d best = nearest_branch(theta, reference);
    EXPECT_LT((exponential(best) - exponential(theta)).norm(), 1e-13);
    for (int k = -4; k <= 4; ++k) {
      const Eigen::Vector3d other = theta + 2 * std::numbers::pi * k * theta.normalized();
      EXPECT_LE((best - reference).norm(), (other - reference).norm() + 1e-12);
    }
  }
}

TEST(RotationsLogarithm, FullTurnsOfTheIdentityTakeTheReferencesAxis) {
  const Eigen::Vector3d reference(0.1, 0, 6.2);
  const Eigen::Vector3d theta = logarithm_near(Eigen::Quaterniond::Identity(), reference);
  EXPECT_NEAR(theta.norm(), 2 * std::numbers::pi, 1e-14);
  EXPECT_LT(theta.cross(reference).norm(), 1e-13);
  EXPECT_EQ(0, logarithm_near(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 1, 0)).norm());
}

}  // namespace
}  // namespace limber::rotations
