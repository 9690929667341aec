// What a session finds out about the edges of its shapes, after each final result.

#include "engine/session/linkages/shape_check.h"

#include <gtest/gtest.h>

#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session::testing {
namespace {

TEST(ShapeChecks, FollowEveryFinalResult) {
  LiveSession live(hyperboloid());
  const auto first = live.recorder->wait_checked(0);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->is_final);
  const auto opened = live.edit({SetMeanAngle{50 * kDegree}});
  ASSERT_TRUE(opened && opened->report.converged());
  EXPECT_EQ(opened->check, Check::kPending);
  EXPECT_FALSE(opened->shape_check);
  const auto checked = live.recorder->wait_checked(opened->revision);
  ASSERT_TRUE(checked && checked->shape_check) << (checked ? checked->check_failure : "");
  EXPECT_EQ(checked->sequence, opened->sequence + 1);
  EXPECT_EQ(checked->frames, opened->frames);
  EXPECT_EQ(checked->since_edit_ms, opened->since_edit_ms);
  const ShapeCheck& check = *checked->shape_check;
  ASSERT_TRUE(check.error.is_known()) << check.error.message;
  EXPECT_GT(check.position_error(), 0);
  EXPECT_LT(check.position_error(), 0.05);
  EXPECT_GT(check.error.energy_error, 0);
  EXPECT_GT(check.error.compared_edges, check.error.edges);
  EXPECT_GT(check.check_ms, 0);
  EXPECT_EQ(check.tolerance, 0);
  EXPECT_TRUE(check.within_tolerance());
  EXPECT_EQ(live.session.newest_result(), checked);
  EXPECT_EQ(live.session.final_result(), checked);
  EXPECT_FALSE(live.recorder->has_gap());
}

TEST(ShapeChecks, ShrinkWithTheSquareOfTheEdges) {
  double coarse = 0;
  for (const int edges : {5, 10}) {
    scene::Linkage linkage = hyperboloid();
    linkage.edges_per_segment = edges;
    linkage.conditions.mean_angle = 50 * kDegree;
    LiveSession live(linkage);
    const auto checked = live.recorder->wait_checked(0);
    ASSERT_TRUE(checked && checked->shape_check);
    const double error = checked->shape_check->position_error();
    if (edges == 10) {
      EXPECT_LT(error, coarse / 3);
      EXPECT_GT(error, coarse / 8);
    }
    coarse = error;
  }
}

TEST(ShapeChecks, AreGivenUpForEdits) {
  LiveSession live(hyperboloid());
  Revision last = 0;
  for (int step = 0; step < 20; ++step)
    last = live.session.edit({SetMeanAngle{(40 + 0.2 * step) * kDegree}}).revision;
  const auto checked = live.recorder->wait_checked(last);
  ASSERT_TRUE(checked && checked->shape_check);
  EXPECT_EQ(checked->revision, last);
  EXPECT_NEAR(checked->mean_angle, 43.8 * kDegree, 1e-9);
}

TEST(ShapeChecks, FollowNoShapeThatWasNotReached) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_checked(0));
  const auto failed =
      live.edit({SetJointLoad{{3, {0, 0, 5}, {0, 0, 0}, 0}}});  // nothing holds it against that
  ASSERT_TRUE(failed && failed->solve_failed);
  EXPECT_EQ(failed->check, Check::kNone);
  EXPECT_EQ(live.session.newest_result(), failed);
}

TEST(ShapeChecks, SayWhereAToleranceIsMissed) {
  ShapeCheck check;
  check.size = 2;
  check.error.edges = 40;
  check.error.max_distance = 0.02;
  EXPECT_TRUE(check.within_tolerance());
  EXPECT_EQ(describe_shape(check), "");
  check.tolerance = 0.02;
  EXPECT_EQ(describe_shape(check), "");
  check.tolerance = 0.005;
  EXPECT_FALSE(check.within_tolerance());
  EXPECT_NE(describe_shape(check).find("0.01"), std::string::npos) << describe_shape(check);
  check.error.message = "it is elsewhere";
  EXPECT_NE(describe_shape(check).find("elsewhere"), std::string::npos);
}

}  // namespace
}  // namespace limber::session::testing
