// Messages on equilibria that were not found.

#include "engine/rods/equilibrium/equilibrium_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

TEST(EquilibriumText, NamesThePlaceOfAnUnknown) {
  const LinkageGraph graph = build_linkage_graph(testing::mixed_mesh());
  const ReducedVariables variables(graph, 5);
  for (int s = 0; s < variables.segments(); ++s) {
    const std::string name = "segment " + std::to_string(s);
    EXPECT_EQ(detail::place_of(variables, variables.chain_begin(s)), name);
    EXPECT_EQ(detail::place_of(variables, variables.chain_begin(s) + variables.chain_size(s) - 1),
              name);
  }
  for (int j = 0; j < variables.joints(); ++j) {
    const std::string name = "joint " + std::to_string(j);
    EXPECT_EQ(detail::place_of(variables, variables.joint_begin(j)), name);
    EXPECT_EQ(detail::place_of(variables, variables.joint_begin(j) + kJointUnknowns - 1), name);
  }
}

TEST(EquilibriumText, OfTooFewStepsSaysWhereHowMuchAndWhatToDo) {
  const LinkageModel model = testing::grid_model(3, 3, 0.6);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle, {}}};
  conditions.loads = {{8, Eigen::Vector3d(0, 0, -20), Eigen::Vector3d::Zero(), 0}};
  const EquilibriumReport report = equilibrium.solve(state, conditions, {.max_iterations = 1});
  ASSERT_EQ(report.status, EquilibriumStatus::kIterationLimit);
  EXPECT_THAT(report.message,
              MatchesRegex("no equilibrium was found in 1 steps: the (force|moment) at "
                           "(joint|segment) [0-9]+ is out of balance by .*% of the largest "
                           "\\(limit 1e-06 %\\); request a smaller change, or release what holds "
                           "the linkage there"));
}

TEST(EquilibriumText, OfLoadsThatNothingHoldsSaysTheirResultantAndWhatToDo) {
  const LinkageModel model = testing::grid_model(3, 3, 0.6);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.loads = {{8, Eigen::Vector3d(0, 0, -20), Eigen::Vector3d::Zero(), 0}};
  EXPECT_THAT(equilibrium.solve(state, conditions).message,
              HasSubstr("the loads on the linkage have a resultant of 20 N, and no support holds "
                        "it: pin a joint"));
}

TEST(EquilibriumText, NamesTheSegmentThatIsFoldedBack) {
  const LinkageModel model = testing::grid_model(3, 3, 0.6);
  LinkageState state(model);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(model.variables().size());
  const Eigen::Vector3d edge = state.vertex(model, 4, 3) - state.vertex(model, 4, 2);
  step.segment<3>(model.variables().position(4, 3)) = -2 * edge;
  state = state.moved(model, step, LinkageState::Parts::kVertices);
  EXPECT_THAT(detail::degenerate_text(model, state),
              HasSubstr("segment 4 has an edge that has no length or is folded back"));
}

}  // namespace
}  // namespace limber::rods
