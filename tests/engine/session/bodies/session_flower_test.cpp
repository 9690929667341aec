// The scene of the paper's figure 5 under the load of an interactive user.

#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/session.h"
#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;

TEST(SessionFlower, TwoThousandMovesEndAtAColdSolve) {
  scene::Scene scene = scene::make_sample("flower");
  // Sideways only: a stem asked to be shorter than its length buckles, to one side or the other,
  // and then a warm and a cold solve may rightly end in different minima.
  for (scene::Constraint& constraint : scene.constraints) constraint.axes = 5;
  test::Pool pool(1);
  const auto recorder = std::make_shared<test::Recorder>();
  BodySession session("flower", scene, {}, test::shared_cache(), pool.executor(), recorder);
  ASSERT_TRUE(recorder->wait_final(0));
  const std::vector<scene::Constraint> opened = session.constraints();
  ASSERT_FALSE(opened.empty());
  const double reach =
      0.05 *
      (scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff()).maxCoeff();
  Random random(2000);
  for (int i = 0; i < 2000; ++i) {
    const auto& constraint = opened[random.index(opened.size())];
    const Eigen::Vector3d nudge(random.uniform(-reach, reach), random.uniform(-reach, reach),
                                random.uniform(-reach, reach));
    session.edit({MoveConstraint{constraint.id, constraint.target + nudge}});
    // A few solves end, most are overtaken.
    if (i % 50 == 0) {
      ASSERT_TRUE(recorder->wait_final(static_cast<Revision>(i + 1)));
    }
  }
  const auto final = recorder->wait_final(2000);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_EQ(recorder->fault(), "");
  EXPECT_GE(recorder->results().size(), 80u);
  const auto fresh = test::solve_fresh(session.scene(), test::shared_cache());
  ASSERT_TRUE(fresh);
  EXPECT_EQ(fresh->report.status, SolveStatus::kConverged) << fresh->report.message;
  EXPECT_NEAR(final->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy);
}

}  // namespace
}  // namespace limber::session
