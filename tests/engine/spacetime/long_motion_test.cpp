// Motions of many frames: an edit costs what its constraints ask for, whatever their distance.
#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/chain_kinematics.h"

namespace limber::spacetime {
namespace {

using Eigen::MatrixXd;

constexpr int kModes = 8;

/// Counts the poses that are asked for.
class CountingKinematics final : public reduced::Kinematics {
 public:
  [[nodiscard]] int coordinate_count() const override { return chain_.coordinate_count(); }
  [[nodiscard]] double length() const override { return chain_.length(); }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                MatrixXd* jacobian) const override {
    poses_ += z.cols();
    chain_.evaluate(frames, z, queries, u, jacobian);
  }

  [[nodiscard]] const testing::ChainKinematics& chain() const { return chain_; }
  [[nodiscard]] Eigen::Index take_poses() { return std::exchange(poses_, 0); }

 private:
  testing::ChainKinematics chain_{kModes, 6, 1.0, 1.0, 5};
  mutable Eigen::Index poses_ = 0;
};

class LongMotion {
 public:
  explicit LongMotion(int frames)
      : timeline_{frames, EndCondition::kFree, EndCondition::kFree}, solver_(make_solver()) {
    for (const auto& constraint : test_constraints(kinematics_->chain(), 6, timeline_, 0.3, 1, 8))
      solver_.add(constraint);
    solver_.solve();
    static_cast<void>(kinematics_->take_poses());
  }

  SolveReport move_a_target() {
    PositionConstraint moved = solver_.constraints()[2];
    solver_.move(moved.id, moved.target + Eigen::Vector3d(0.01, -0.01, 0.02));
    solver_.correct();
    return solver_.solve();
  }

  [[nodiscard]] MatrixXd cold_motion() const {
    Solver fresh = make_solver();
    for (const auto& constraint : solver_.constraints()) fresh.add(constraint);
    fresh.solve();
    return fresh.motion();
  }

  [[nodiscard]] Solver& solver() { return solver_; }
  [[nodiscard]] Eigen::Index take_poses() { return kinematics_->take_poses(); }

 private:
  [[nodiscard]] Solver make_solver() const {
    return {kinematics_, test_dynamics(kModes, 60, 0.02), timeline_};
  }

  std::shared_ptr<CountingKinematics> kinematics_ = std::make_shared<CountingKinematics>();
  Timeline timeline_;
  Solver solver_;
};

TEST(LongMotion, PosesOfAnEditDoNotGrowWithFrames) {
  LongMotion shortest(1'000);
  EXPECT_EQ(shortest.move_a_target().status, SolveStatus::kConverged);
  const Eigen::Index poses = shortest.take_poses();
  ASSERT_GT(poses, 0);
  for (const int frames : {10'000, 100'000}) {
    LongMotion motion(frames);
    EXPECT_EQ(motion.move_a_target().status, SolveStatus::kConverged);
    EXPECT_LE(motion.take_poses(), 2 * poses) << frames;
  }
}

TEST(LongMotion, AnEditEndsWhereAColdSolveDoes) {
  LongMotion motion(100'000);
  motion.move_a_target();
  const MatrixXd cold = motion.cold_motion();
  EXPECT_LE((motion.solver().motion() - cold).cwiseAbs().maxCoeff(),
            1e-6 * cold.cwiseAbs().maxCoeff());
}

TEST(LongMotion, SomeFramesAreThoseOfTheWholeMotion) {
  for (const auto& [first, count] : {std::pair{0, 1}, {0, 1'000}, {3, 500}, {990, 10}, {400, 0}}) {
    LongMotion motion(1'000);
    PositionConstraint moved = motion.solver().constraints()[2];
    motion.solver().move(moved.id, moved.target + Eigen::Vector3d(0.05, -0.05, 0.1));
    motion.solver().correct();
    const MatrixXd some = motion.solver().motion_in({first, count});
    EXPECT_EQ(some, motion.solver().motion().middleCols(first, count)) << first;
    EXPECT_EQ(motion.solver().motion_in({first, count}), some) << "once the whole motion is known";
  }
  LongMotion motion(1'000);
  EXPECT_THROW(static_cast<void>(motion.solver().motion_in({999, 2})), Error);
  EXPECT_THROW(static_cast<void>(motion.solver().motion_in({-1, 2})), Error);
}

TEST(LongMotion, StaysBitForBitWhereItIsTakenUpAgain) {
  LongMotion motion(1'000);
  const MatrixXd before = motion.solver().motion();
  motion.solver().warm_start(motion.solver().motion(), Known::kAnswer);
  EXPECT_EQ(motion.solver().motion(), before);
  motion.solver().warm_start(MatrixXd(before), Known::kAnswer);
  EXPECT_EQ(motion.solver().motion(), before);
}

}  // namespace
}  // namespace limber::spacetime
