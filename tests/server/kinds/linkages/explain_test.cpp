#include "server/kinds/linkages/explain.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

proto::ModelChoice edges_choice(const proto::ExplainResponse& explained) {
  for (const proto::ModelChoice& choice : explained.choices())
    if (choice.name() == "edges per segment") return choice;
  ADD_FAILURE() << "edges are not explained";
  return {};
}

/// A session has edges per segment whoever chose them, and may have a tolerance beside.
TEST(LinkageExplanation, SaysWhoChoseTheEdges) {
  proto::RodLinkage linkage;
  linkage.set_edges_per_segment(12);
  proto::ModelChoice choice = edges_choice(explain_linkage({}, linkage, ChosenBy::kScene));
  EXPECT_TRUE(choice.asked_for());
  EXPECT_EQ(choice.number(), 12);

  linkage.set_tolerance(1e-3);
  const proto::ExplainResponse both = explain_linkage({}, linkage, ChosenBy::kScene);
  choice = edges_choice(both);
  EXPECT_TRUE(choice.asked_for());
  EXPECT_NE(choice.reason().find("edges_per_segment of the scene"), std::string::npos)
      << choice.reason();
  // What it asks for is said all the same.
  EXPECT_EQ(both.errors(0).quantity(), "positions");
  EXPECT_EQ(both.errors(0).tolerance(), 1e-3);

  choice = edges_choice(explain_linkage({}, linkage, ChosenBy::kLimber));
  EXPECT_FALSE(choice.asked_for());
  EXPECT_EQ(choice.number(), 12);
  EXPECT_NE(choice.reason().find("tolerance is 0.001"), std::string::npos) << choice.reason();
}

}  // namespace
}  // namespace limber::server
