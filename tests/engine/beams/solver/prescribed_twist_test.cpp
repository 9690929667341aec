#include <gtest/gtest.h>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/twist_watch.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

/// A rod of unit torsional stiffness whose axis stays straight; one end is turned about it.
BeamModel turned_rod(int elements, double angle) {
  BeamModel model = limber::testing::straight_beam(elements, 1, 100);
  model.supports.push_back(limber::testing::clamped(0));
  for (int i = 1; i < elements; ++i)
    model.supports.push_back({i, {false, true, true, false, false, false}});
  PrescribedMotion motion;
  motion.node = elements;
  motion.translates = {true, true, true};
  motion.rotates = {true, true, true};
  motion.rotation = {angle, 0, 0};
  model.motions.push_back(motion);
  return model;
}

double torque_over_exact(const BeamStructure& structure, const BeamSolution& found, double angle) {
  return results_of(structure, found.state).forces[0].torque /
         (structure.model().sections[0].torsion * angle);
}

class BeamPrescribedTwist : public ::testing::TestWithParam<BeamMethod> {
 protected:
  [[nodiscard]] static BeamSolution solve(const BeamStructure& structure) {
    BeamSolveOptions options;
    options.method = GetParam();
    return find_equilibrium(structure, options);
  }
};

TEST_P(BeamPrescribedTwist, OfManyRadiansGivesItsTorqueAndSaysWhereThatIsOff) {
  for (const double angle : {6.0, -9.0, 12.0}) {
    const BeamStructure structure(turned_rod(8, angle));
    const BeamSolution found = solve(structure);
    ASSERT_TRUE(found.report.converged()) << angle << ": " << found.report.message;
    EXPECT_NEAR(torque_over_exact(structure, found, angle), 1, 0.012) << angle;
    EXPECT_EQ(found.report.message.find("twisted") != std::string::npos, angle == 12)
        << found.report.message;
  }
}

/// Attitudes of the ends are the same after whole turns fewer, at which it would balance too.
TEST_P(BeamPrescribedTwist, BeyondWhatElementsShowIsUnstable) {
  for (const auto& [elements, angle] :
       {std::pair{4, 12.0}, {8, 20.0}, {4, -6.0 * 3.1416}, {4, 1e6}}) {
    const BeamStructure structure(turned_rod(elements, angle));
    const BeamSolution found = solve(structure);
    EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << angle << ": " << found.report.message;
    EXPECT_NE(found.report.message.find("shorter elements"), std::string::npos)
        << angle << ": " << found.report.message;
    EXPECT_NE(found.report.message.find("element "), std::string::npos) << found.report.message;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BeamPrescribedTwist,
                         ::testing::Values(BeamMethod::kChoose, BeamMethod::kNewton,
                                           BeamMethod::kRelaxation,
                                           BeamMethod::kRelaxationThenNewton),
                         [](const auto& test) {
                           return "Method" + std::to_string(static_cast<int>(test.param));
                         });

TEST(BeamPrescribedTwistInSteps, ContinuesFromEarlierTurns) {
  BeamState state = BeamStructure(turned_rod(8, 0)).rest_state();
  double before = 0;
  for (const double angle : {5.0, 10.0, 12.0, 14.0}) {
    const BeamStructure structure(turned_rod(8, angle));
    const BeamSolution found =
        follow_equilibrium(structure, state, {{8, {before, 0, 0}}}, BeamSolveOptions::following());
    ASSERT_TRUE(found.report.converged()) << angle << ": " << found.report.message;
    EXPECT_NEAR(torque_over_exact(structure, found, angle), 1, 0.025) << angle;
    state = found.state;
    before = angle;
  }
  const BeamSolution found =
      follow_equilibrium(BeamStructure(turned_rod(8, 20)), state, {{8, {before, 0, 0}}},
                         BeamSolveOptions::following());
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_NE(found.report.message.find("shorter elements"), std::string::npos)
      << found.report.message;
}

/// A rod that turns as a whole is not twisted, however often.
TEST(BeamPrescribedTwistInSteps, TurnsOfTheWholeRodAreNone) {
  BeamModel model = turned_rod(4, 40);
  model.supports[0].fixed[3] = false;
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_LT(found.report.elastic_energy, 1e-9);
}

TEST(BeamTwistWatch, CountsTurnsThatAttitudesDoNotShow) {
  const BeamStructure structure(turned_rod(2, 0));
  BeamState state = structure.rest_state();
  detail::TwistWatch watch(structure, state);
  const auto turn_to = [&](double angle) {
    state.rotations[2] = rotation_by({angle, 0, 0});
    watch.look(state);
    return watch.slipped();
  };
  EXPECT_FALSE(turn_to(2.5));
  EXPECT_EQ(detail::most_twisted(structure, state).element, 1);
  EXPECT_NEAR(detail::most_twisted(structure, state).angle, 2.5, 1e-12);
  EXPECT_EQ(turn_to(4.5), 1);
  EXPECT_EQ(turn_to(6.3), 1);
  EXPECT_EQ(turn_to(4.0), 1);
  EXPECT_FALSE(turn_to(3.0));
}

}  // namespace
}  // namespace limber::beams
