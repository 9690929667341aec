// Edits of a linkage while it is solved for, and how sessions of linkages end.

#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;
using testing::hyperboloid;
using testing::joint_at;
using testing::LinkageRecorder;
using testing::LiveSession;

TEST(LinkageSession, AnExecutorThatDropsOrRefusesTasksLosesNothing) {
  const auto recorder = std::make_shared<LinkageRecorder>();
  std::vector<std::function<void()>> kept;
  bool drop = true, refuse = false;
  const Executor executor = [&](std::function<void()> task) {
    if (refuse) throw std::runtime_error("full");
    if (!drop) kept.push_back(std::move(task));
  };
  LinkageSession session("dropped", hyperboloid(), {}, executor, recorder);
  drop = false;
  refuse = true;
  EXPECT_EQ(session.edit({SetMeanAngle{0.3}}).revision, 1u);
  EXPECT_NE(session.state_message().find("full"), std::string::npos);
  refuse = false;
  EXPECT_EQ(session.edit({SetMeanAngle{0.2}}).revision, 2u);
  ASSERT_EQ(kept.size(), 1u);
  kept[0]();
  const auto final = recorder->wait_final(2);
  ASSERT_TRUE(final);
  EXPECT_NEAR(final->mean_angle, 0.2, 1e-6);
  kept.clear();
}

TEST(LinkageSession, APinHoldsWhatTheEditsBeforeItLeadTo) {
  const auto energy = [](bool patient) {
    LiveSession live(hyperboloid());
    const std::vector<std::vector<LinkageEdit>> edits = {{SetMeanAngle{40 * kDegree}},
                                                         {PinJoint{3, Held::kMotion}},
                                                         {PinJoint{70, Held::kMotion}},
                                                         {SetMeanAngle{50 * kDegree}}};
    Revision last = 0;
    for (const auto& edit : edits) {
      last = live.session.edit(edit).revision;
      if (patient && !live.recorder->wait_final(last)) return 0.0;
    }
    const auto final = live.recorder->wait_final(last);
    return final ? final->report.energies.total() : 0;
  };
  const double waiting = energy(true);
  EXPECT_GT(waiting, 0);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(energy(false), waiting, 1e-6 * waiting);
}

TEST(LinkageSession, AStormOfEditsEndsInTheNewest) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  scene::LinkageTarget target;
  target.joint = 80;
  target.position = joint_at(live.session, *opened, 80);
  target.stiffness = 1e4;
  live.session.edit({PinJoint{0, Held::kMotion}, AddTarget{target}});
  Revision last = 0;
  for (int i = 1; i <= 200; ++i) {
    last = live.session.edit({MoveTarget{1, target.position + Eigen::Vector3d(0.0002 * i, 0, 0)}})
               .revision;
  }
  const auto final = live.recorder->wait_final(last);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, EquilibriumStatus::kConverged) << final->report.message;
  EXPECT_EQ(live.session.linkage().conditions.targets.at(0).position.x(),
            target.position.x() + 0.0002 * 200);
  // Pins hold joints where they are: from the same equilibrium, one edit after the other.
  LiveSession slow(hyperboloid());
  ASSERT_TRUE(slow.recorder->wait_final(0));
  ASSERT_TRUE(slow.edit({PinJoint{0, Held::kMotion}, AddTarget{target}}));
  const auto direct = slow.edit({MoveTarget{1, live.session.conditions()->targets[0].position}});
  ASSERT_TRUE(direct);
  EXPECT_NEAR(direct->report.potential(), final->report.potential(),
              1e-6 * std::abs(direct->report.potential()));
  EXPECT_FALSE(live.recorder->has_gap());
}

TEST(LinkageSession, CancellingKeepsTheLastEquilibrium) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  live.recorder->cancel_on_iterate(live.session);
  const Revision revision = live.session.edit({SetMeanAngle{opened->mean_angle + 1.0}}).revision;
  const auto final = live.recorder->wait_final(revision);
  ASSERT_TRUE(final);
  EXPECT_FALSE(final->solve_failed);
  ASSERT_EQ(final->report.status, EquilibriumStatus::kCancelled);
  EXPECT_NEAR(final->mean_angle, opened->mean_angle, 1e-6);
  // And continues on the next request.
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_EQ(undone->report.status, EquilibriumStatus::kConverged);
}

TEST(LinkageSession, ClosingEndsEverything) {
  auto live = std::make_unique<LiveSession>(hyperboloid());
  ASSERT_TRUE(live->recorder->wait_final(0));
  live->session.edit({SetMeanAngle{1.2}});
  live->session.close();
  EXPECT_TRUE(live->recorder->wait_state(State::kClosed));
  EXPECT_THROW(live->session.edit({SetMeanAngle{1.0}}), Error);
  EXPECT_TRUE(live->session.newest_result());
}

}  // namespace
}  // namespace limber::session
