// Targets that a body cannot get to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "engine/session/bodies/reach.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using test::held;
using test::kTip;
using test::Live;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

scene::Constraint exactly(scene::Constraint constraint) {
  constraint.weight = std::numeric_limits<double>::infinity();
  return constraint;
}

TEST(SessionReach, AFarTargetIsNamedWithTheDistanceThatIsLeft) {
  scene::Scene scene = test::bent_bar();
  scene.constraints = {held(10, kTip, {0, 0.1, 0.05})};
  Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  const double length = live.session.model()->length;
  // A weight that hardly pulls, and a target that no shape gets near to.
  scene::Constraint light = held(20, kTip, {0, 20 * length, 0});
  light.weight = 1e-6;
  for (const auto& far : {light, exactly(held(20, kTip, {0, 2000 * length, 0}))}) {
    SCOPED_TRACE(far.weight);
    const auto result = live.edit({AddConstraint{far}});
    ASSERT_TRUE(result);
    const std::uint64_t id = live.session.constraints().back().id;
    const double left =
        (test::tip_at(live.session, *result, 20) -
         live.session.positions(*result, 0, 1).col(0).segment<3>(3 * kTip) - far.target)
            .norm();
    ASSERT_GT(left, 0.5 * length);
    ASSERT_FALSE(result->out_of_reach.empty());
    EXPECT_EQ(result->out_of_reach[0].id, id);
    EXPECT_NEAR(result->out_of_reach[0].distance, left, 0.02 * left + 1e-3 * length);
    EXPECT_THAT(result->report.message,
                HasSubstr("Constraint " + std::to_string(id) + " in frame 20 is out of reach"));
    ASSERT_TRUE(live.edit({RemoveConstraint{id}}));
  }
}

TEST(SessionReach, SolvesThatEndedBeforeTheOptimumSayItOfFarTargetsAlone) {
  using spacetime::SolveStatus;
  const double length = 0.5;
  spacetime::PositionConstraint near, far;
  near.id = 1;
  near.target = {0, 1.9 * length, 0};
  far.id = 2;
  far.target = {0, 2.1 * length, 0};
  spacetime::SolveReport report;
  report.missed = {{1, 0.1, true}, {2, 0.1, true}};
  const auto ids = [&](SolveStatus status) {
    report.status = status;
    std::vector<std::uint64_t> found;
    for (const auto& miss : out_of_reach(report, {near, far}, length)) found.push_back(miss.id);
    return found;
  };
  EXPECT_THAT(ids(SolveStatus::kConverged), ElementsAre(1, 2));
  EXPECT_THAT(ids(SolveStatus::kStalled), ElementsAre(2));
  EXPECT_THAT(ids(SolveStatus::kIterationLimit), ElementsAre(2));
  EXPECT_THAT(ids(SolveStatus::kCancelled), ElementsAre());
}

TEST(SessionReach, TargetsThatAreMetAreNot) {
  Live live(test::bent_bar());
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->out_of_reach.empty());
  EXPECT_THAT(result->report.message, Not(HasSubstr("out of reach")));
}

TEST(SessionReach, ContradictionsAreNoMatterOfTheModel) {
  scene::Scene scene = test::bent_bar();
  scene.constraints = {exactly(held(10, kTip, {0, 0.1, 0.05})),
                       exactly(held(10, kTip, {0, -0.1, 0.05}))};
  scene.constraints[1].id = 2;
  Live live(scene);
  const auto result = live.recorder->wait_checked(0);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.rank_deficient);
  EXPECT_TRUE(result->out_of_reach.empty());
  EXPECT_THAT(result->report.message, HasSubstr("contradict"));
  EXPECT_THAT(result->report.message, Not(HasSubstr("smaller model.tolerance")));
}

}  // namespace
}  // namespace limber::session
