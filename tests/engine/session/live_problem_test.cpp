#include "engine/session/live_problem.h"

#include <gtest/gtest.h>

#include "tests/engine/session/document_support.h"
#include "tests/engine/session/session_support.h"

namespace limber::session {
namespace {

using test::bent_bar;
using test::Live;

/// The most sites a problem ever has while one of its constraints moves from group to group.
int most_sites(SiteLimits limits) {
  const scene::Scene scene = bent_bar();
  Live live(scene);
  EXPECT_TRUE(live.recorder->wait_final(0));
  const MappedBody mapped = map_body(scene);
  LiveProblem problem(live.session.model(), nullptr, TargetFrame(scene, mapped),
                      std::make_unique<KeyframeTargets>(scene, live.session.model()),
                      ProblemTerms{scene.frame_count, scene.model.mode_count, {}}, {}, limits);
  Document document(scene);
  problem.start(whole_batch(document));
  int most = 0;
  scene::Constraint group = document.constraint_list().front();
  for (int i = 0; i < 40; ++i) {
    group.nodes = {i, i + 1, i + 2};
    Touched touched;
    document.apply({ReplaceConstraint{group}}, {}, touched);
    problem.apply(batch_of(document, touched));
    most = std::max(most, problem.site_count());
    EXPECT_EQ(problem.solver().constraints().size(), 2u);
    EXPECT_EQ(problem.solver().constraints().front().frame, group.frame);
  }
  return most;
}

TEST(LiveProblem, ForgetsSitesOnceThereAreManyOrTheyNameManyNodes) {
  EXPECT_GT(most_sites({}), 40);
  EXPECT_LE(most_sites({12, 16'000'000}), 13);
  EXPECT_LE(most_sites({20000, 16}), 8);
}

TEST(LiveProblem, KeepsSitesThatAreInUse) { EXPECT_GT(most_sites({20000, 6}), 40); }

}  // namespace
}  // namespace limber::session
