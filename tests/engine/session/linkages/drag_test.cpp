// What is shown of a linkage while edits come faster than its equilibria.

#include <gtest/gtest.h>

#include <memory>

#include "engine/session/linkages/live_problem.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using scene::Held;
using testing::hyperboloid;
using testing::joint_at;
using testing::LiveSession;
using Conditions = std::shared_ptr<const scene::LinkageConditions>;

constexpr int kDragged = 80;  // joint

/// Held at a joint, and pulled at another by a spring, from where that is.
Conditions pulled(const Eigen::Vector3d& to) {
  auto conditions = std::make_shared<scene::LinkageConditions>();
  conditions->pins = {{0, Held::kMotion, {}}};
  scene::LinkageTarget target;
  target.id = 1;
  target.joint = kDragged;
  target.position = to;
  target.stiffness = 1e4;
  conditions->targets = {target};
  return conditions;
}

Eigen::Vector3d dragged_joint(const LiveLinkage& live) {
  return live.state().joints()[kDragged].position;
}

/// Each move interrupts the solve before at the first shape that is shown of it.
TEST(LinkageDrag, EveryMoveShowsAShapeThoughNoSolveEnds) {
  LiveLinkage live(hyperboloid());
  ASSERT_TRUE(live.is_slow());
  const Eigen::Vector3d home = dragged_joint(live);
  ASSERT_TRUE(live.solve(pulled(home), {}, [] {}).reached);
  Eigen::Vector3d to = home;
  for (int i = 1; i <= 30; ++i) {
    to = home + 0.002 * i * Eigen::Vector3d(1, 0.5, 0);
    Cancellation cancellation;
    int shown = 0;
    Eigen::Vector3d at = home;
    const auto outcome = live.solve(pulled(to), {cancellation, {}}, [&] {
      ++shown;
      at = dragged_joint(live);
      cancellation.request();
    });
    EXPECT_FALSE(outcome.reached) << i;
    EXPECT_EQ(outcome.report.status, rods::EquilibriumStatus::kCancelled) << i;
    ASSERT_GT(shown, 0) << i;
    // It follows the mouse, from where the joint is in equilibrium: not quite where it is drawn.
    if (i >= 5) {
      EXPECT_LT((at - to).norm(), 0.5 * (home - to).norm()) << i;
    }
    live.stay_near();
  }
  // The equilibrium behind it is that of a single edit.
  LiveLinkage waited(hyperboloid());
  ASSERT_TRUE(waited.solve(pulled(home), {}, [] {}).reached);
  const auto direct = waited.solve(pulled(to), {}, [] {});
  const auto last = live.solve(pulled(to), {}, [] {});
  ASSERT_TRUE(direct.reached && last.reached) << direct.report.message << last.report.message;
  EXPECT_NEAR(last.report.potential(), direct.report.potential(),
              1e-6 * std::abs(direct.report.potential()));
  EXPECT_LT((dragged_joint(live) - dragged_joint(waited)).norm(), 1e-5);
}

TEST(LinkageDrag, TheFirstShapeOfAMoveIsNearerAndNotFinal) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const Eigen::Vector3d home = joint_at(live.session, *opened, kDragged);
  scene::LinkageTarget target = pulled(home)->targets[0];
  target.id = 0;
  const auto held = live.edit({PinJoint{0, Held::kMotion}, AddTarget{target}});
  ASSERT_TRUE(held);
  const Revision revision =
      live.session.edit({MoveTarget{1, home + Eigen::Vector3d(0.02, 0.01, 0)}}).revision;
  const auto final = live.recorder->wait_final(revision);
  ASSERT_TRUE(final);
  const auto first = live.recorder->first_of(revision);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->is_final);
  EXPECT_FALSE(first->report.converged());
  const Eigen::VectorXd end = final->frames->rightCols<1>();
  EXPECT_LT((first->frames->rightCols<1>() - end).norm(),
            (held->frames->rightCols<1>() - end).norm());
  EXPECT_FALSE(live.recorder->has_gap());
}

}  // namespace
}  // namespace limber::session
