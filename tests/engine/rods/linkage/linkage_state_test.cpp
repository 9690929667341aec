#include "engine/rods/linkage/linkage_state.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/engine/rods/linkage/state_charts.h"

namespace limber::rods {
namespace {

/// A state is its own source, so that joints may turn round and round.
TEST(LinkageState, TurnsBeyondAWholeRoundByNewStates) {
  const LinkageModel model = testing::curved_model();
  Random random(3);
  const LinkageState start = LinkageState(model).moved(
      model, testing::random_increment(model.variables().size(), 0.1, random));
  LinkageAssembly assembly(model);
  const RodEnergies energies = assembly.energies(start);
  ASSERT_GT(energies.twisting, 1);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 0.5).normalized();
  LinkageState state = start;
  for (int times = 1; times <= 13; ++times) {  // radians: past pi, 2 pi and 4 pi
    SCOPED_TRACE(times);
    state =
        state.moved(model, testing::rigid_increment(model, state, axis, Eigen::Vector3d::Zero()));
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(times, axis).toRotationMatrix();
    const double rounding = 1e-13 * times;  // of unit vectors; places are up to 200 from the origin
    for (std::size_t j = 0; j < start.joints().size(); ++j) {
      const JointState<double>&was = start.joints()[j], &is = state.joints()[j];
      EXPECT_LT((is.position - turn * was.position).norm(), 200 * rounding);
      EXPECT_LT((is.normal - turn * was.normal).norm(), rounding);
      EXPECT_LT((is.bisector - turn * was.bisector).norm(), rounding);
      EXPECT_EQ(is.opening_angle, was.opening_angle);
    }
    for (int s = 0; s < model.variables().segments(); ++s) {
      const int edges = model.variables().edges(s);
      for (int i = 0; i <= edges; ++i) {
        EXPECT_LT((state.vertex(model, s, i) - turn * start.vertex(model, s, i)).norm(),
                  200 * rounding);
        if (i == edges) continue;
        EXPECT_LT((state.director(model, s, i) - turn * start.director(model, s, i)).norm(),
                  1e2 * rounding);
        if (i > 0) {
          EXPECT_NEAR(state.twist(model, s, i), start.twist(model, s, i), 1e2 * rounding);
        }
      }
    }
    const RodEnergies now = assembly.energies(state);
    EXPECT_NEAR(now.total(), energies.total(), 1e-11 * times * energies.total());
    EXPECT_NEAR(now.twisting, energies.twisting, 1e-11 * times * energies.twisting);
  }
}

/// The joint alone turns about a rod: the rod is twisted on both sides of it, by whole rounds.
TEST(LinkageState, TwistFollowsAJointBeyondAWholeRound) {
  const LinkageModel model = testing::grid_model(3, 3, std::numbers::pi / 2);
  const int joint = 4;  // in the middle
  LinkageState state(model);
  const Eigen::Vector3d along = state.joints()[joint].tangent(kRodA);
  Eigen::VectorXd increment = Eigen::VectorXd::Zero(model.variables().size());
  increment.segment<3>(model.variables().joint_begin(joint) + kJointRotation) = along;
  for (int times = 1; times <= 7; ++times) {
    state = state.moved(model, increment);
    int sides = 0;
    for (const int s : model.graph().joints[joint].segments[kRodA]) {
      ASSERT_GE(s, 0);
      const int edges = model.variables().edges(s);
      double twist = 0;
      for (int i = 1; i < edges; ++i) twist += state.twist(model, s, i);
      EXPECT_NEAR(std::abs(twist), times, 1e-13 * times);
      sides += twist > 0 ? 1 : -1;
    }
    EXPECT_EQ(sides, 0) << "one is twisted onwards, one backwards";
  }
}

}  // namespace
}  // namespace limber::rods
