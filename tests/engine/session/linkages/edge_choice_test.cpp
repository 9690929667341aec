// Edges per segment by tolerance.

#include "engine/session/linkages/edge_choice.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/session/linkages/mapping.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session::testing {
namespace {

scene::Linkage opened_hyperboloid(double tolerance) {
  scene::Linkage linkage = hyperboloid();
  linkage.edges_per_segment = 0;
  linkage.tolerance = tolerance;
  linkage.conditions.mean_angle = 50 * kDegree;
  return linkage;
}

TEST(EdgeChoices, TighterTolerancesTakeMoreEdges) {
  int before = 0;
  for (const double tolerance : {3e-3, 3e-4, 1e-4}) {
    const EdgeChoice choice = choose_edges(opened_hyperboloid(tolerance), 60);
    EXPECT_EQ(choice.message, "");
    EXPECT_GT(choice.position_error, 0);
    EXPECT_LE(choice.position_error, tolerance);
    EXPECT_GT(choice.edges, before);
    before = choice.edges;
  }
}

TEST(EdgeChoices, CoarseWhereTheyMayBe) {
  EXPECT_EQ(choose_edges(opened_hyperboloid(0.1), 60).edges, 3);
}

TEST(EdgeChoices, SayWhatTheyMiss) {
  const EdgeChoice choice = choose_edges(opened_hyperboloid(1e-6), 8);
  EXPECT_EQ(choice.edges, 8);
  EXPECT_GT(choice.position_error, 1e-6);
  EXPECT_NE(choice.message.find("edges_per_segment"), std::string::npos) << choice.message;
}

TEST(EdgeChoices, AreTheUsualOnesWhereNothingIsDeformed) {
  scene::Linkage linkage = scene::make_linkage_sample("grid");
  linkage.tolerance = 1e-3;
  const EdgeChoice choice = choose_edges(linkage, 60);
  EXPECT_EQ(choice.edges, kUsualEdges);
  EXPECT_NE(choice.message.find("not deformed"), std::string::npos) << choice.message;
}

TEST(EdgeChoices, AreCancelled) {
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW((void)choose_edges(opened_hyperboloid(1e-3), 60, job), Error);
}

TEST(EdgeChoices, AreThoseOfTheSession) {
  LiveSession live(opened_hyperboloid(3e-4));
  EXPECT_EQ(live.session.linkage().tolerance, 3e-4);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked && checked->shape_check);
  const int edges = live.session.linkage().edges_per_segment;
  EXPECT_EQ(edges, choose_edges(opened_hyperboloid(3e-4), 60).edges);
  EXPECT_EQ(live.session.geometry()->edges.front(), edges);
  EXPECT_EQ(checked->shape_check->tolerance, 3e-4);
  EXPECT_TRUE(checked->shape_check->within_tolerance());
  EXPECT_EQ(checked->report.message.find("tolerance"), std::string::npos);
  // Lengths of edges are of those that were chosen.
  const auto wrong = Eigen::VectorXd::Ones(7);
  EXPECT_THROW((void)live.session.edit({SetEdgeLengths{wrong}}), Error);
  const Eigen::VectorXd own = checked->statics->model().edge_lengths();
  const auto result = live.edit({SetEdgeLengths{own}});
  EXPECT_TRUE(result && result->report.converged());
}

TEST(EdgeChoices, LeaveNamedEdges) {
  scene::Linkage linkage = opened_hyperboloid(1e-5);
  linkage.edges_per_segment = 4;
  LiveSession live(linkage);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked && checked->shape_check);
  EXPECT_EQ(live.session.linkage().edges_per_segment, 4);
  EXPECT_FALSE(checked->shape_check->within_tolerance());
  EXPECT_NE(checked->report.message.find("tolerance"), std::string::npos);
}

TEST(EdgeChoices, AreRefusedWhereTheSceneHasOthers) {
  const auto issue_of = [](const scene::Linkage& linkage) {
    const auto issues = check_linkage(linkage).issues;
    return issues.empty() ? "" : issues.front().field;
  };
  scene::Linkage linkage = opened_hyperboloid(1e-3);
  EXPECT_EQ(issue_of(linkage), "");
  linkage.tolerance = 0;
  EXPECT_EQ(issue_of(linkage), "edges_per_segment");
  linkage.tolerance = 0.2;
  EXPECT_EQ(issue_of(linkage), "tolerance");
  linkage.tolerance = 1e-3;
  linkage.conditions.edge_lengths = Eigen::VectorXd::Ones(10);
  EXPECT_EQ(issue_of(linkage), "edges_per_segment");
}

}  // namespace
}  // namespace limber::session::testing
