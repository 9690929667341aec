#include "engine/spacetime/pose_shares.h"

#include <gtest/gtest.h>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::spacetime {
namespace {

constexpr int kShareFrames = 60;

ModeDynamics calm(int modes) {
  ModeDynamics dynamics = test_dynamics(modes, 40, 0.2);
  dynamics.discretisation = Discretisation::kSampled;
  dynamics.smoothing = 4;
  return dynamics;
}

/// Of all keyframes, K x N.
Eigen::MatrixXd pose_shares(const std::vector<KeyframeConstraint>& keyframes,
                            const ModeDynamics& dynamics, const Timeline& timeline) {
  Eigen::MatrixXd shares(static_cast<Eigen::Index>(keyframes.size()), timeline.frame_count);
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    shares.row(static_cast<Eigen::Index>(k)) = pose_share(k, keyframes, dynamics, timeline);
  return shares;
}

Timeline held() {
  return {kShareFrames, EndCondition::kPinnedPositionVelocity, EndCondition::kFree};
}

KeyframeConstraint keyframe(int frame, const Eigen::VectorXd& pose, double weight = kExact) {
  return {static_cast<ConstraintId>(frame), frame, pose, weight};
}

TEST(PoseShares, AreOneInTheirOwnFrameAndZeroInThoseOfOthers) {
  const std::vector<KeyframeConstraint> keyframes = {keyframe(20, Eigen::Vector3d(1, 0.5, 0)),
                                                     keyframe(30, Eigen::Vector3d(-2, 0, 0.1)),
                                                     keyframe(55, Eigen::Vector3d(0, 0, 0))};
  for (const Timeline& timeline :
       {held(), Timeline{kShareFrames, EndCondition::kCyclic, EndCondition::kCyclic}}) {
    const Eigen::MatrixXd shares = pose_shares(keyframes, calm(3), timeline);
    ASSERT_EQ(shares.rows(), 3);
    ASSERT_EQ(shares.cols(), kShareFrames);
    for (int k = 0; k < 3; ++k) {
      for (int other = 0; other < 3; ++other)
        EXPECT_NEAR(shares(k, keyframes[static_cast<std::size_t>(other)].frame), k == other, 1e-8);
    }
  }
}

// A pose of one mode moves like that mode, exact or soft.
TEST(PoseShares, OfAPoseOfOneModeAreTheMotionOfThatMode) {
  const ModeDynamics dynamics = calm(3);
  for (const double weight : {kExact, 0.5}) {
    for (int mode = 0; mode < 3; ++mode) {
      const Eigen::VectorXd pose = 0.3 * Eigen::VectorXd::Unit(3, mode);
      Solver solver(std::make_shared<testing::LinearKinematics>(3, 1, 1.0, 1), dynamics, held());
      solver.add_keyframe(keyframe(25, pose, weight));
      solver.solve();
      const Eigen::MatrixXd shares = pose_shares({keyframe(25, pose, weight)}, dynamics, held());
      const Eigen::RowVectorXd wanted = solver.motion().row(mode) / 0.3;
      EXPECT_LT((shares.row(0) - wanted).norm(), 1e-8 * wanted.norm()) << mode << " " << weight;
      if (weight != kExact) {
        EXPECT_LT(shares(0, 25), 0.999);
      }
    }
  }
}

TEST(PoseShares, OfFiveHundredKeyframesTakeNoMemoryToSpeakOf) {
  std::vector<KeyframeConstraint> keyframes;
  keyframes.reserve(500);
  for (int k = 0; k < 500; ++k) keyframes.push_back(keyframe(3 + 4 * k, Eigen::Vector3d(1, k, 0)));
  const Timeline long_line{2100, EndCondition::kFree, EndCondition::kFree};
  const Eigen::VectorXd share = pose_share(250, keyframes, calm(3), long_line);
  for (const KeyframeConstraint& one : keyframes)
    EXPECT_NEAR(share[one.frame], one.frame == 3 + 4 * 250, 1e-8);
}

TEST(PoseShares, OfAPoseOfTwoModesLieBetweenTheirs) {
  const ModeDynamics dynamics = calm(2);
  const auto before = [&](const Eigen::VectorXd& pose) {
    return pose_shares({keyframe(30, pose)}, dynamics, held())(0, 20);
  };
  const double slow = before(Eigen::Vector2d(1, 0)), fast = before(Eigen::Vector2d(0, 1));
  const double both = before(Eigen::Vector2d(1, 1));
  EXPECT_GT(both, std::min(slow, fast));
  EXPECT_LT(both, std::max(slow, fast));
}

}  // namespace
}  // namespace limber::spacetime
