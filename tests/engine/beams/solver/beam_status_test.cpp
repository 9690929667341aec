#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/base/start_shift.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/uncertain_element.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::BeamEnds;
using limber::testing::cantilever_model;
using limber::testing::clamped;

/// A column pressed by twice its Euler load, perfectly straight.
BeamModel column() {
  BeamModel model = limber::testing::straight_beam(12, 1, 200);
  model.supports.push_back(clamped(0));
  model.loads.push_back({12, {-2 * 2.4674, 0, 0}});  // pi^2 EI / (4 L^2) is its Euler load
  return model;
}

TEST(BeamStatus, NewtonLeavesTheSaddleOfAStraightColumn) {
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  BeamModel model = column();
  // Both bending stiffnesses are equal: its direction is free, so one is chosen.
  model.sections[0].bending_3 *= 2;
  const BeamSolution found = find_equilibrium(BeamStructure(model), options);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_GT(std::abs(found.state.positions(2, 12)), 0.5);
}

TEST(BeamStatus, RelaxationSaysThatAStraightColumnIsASaddle) {
  BeamSolveOptions options;
  options.method = BeamMethod::kRelaxation;
  const BeamSolution found = find_equilibrium(BeamStructure(column()), options);
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_NE(found.report.message.find("saddle"), std::string::npos);
  // Equally stiff in both planes, it may fall in any.
  EXPECT_EQ(found.report.negative_eigenvalues, 2);
  EXPECT_NE(found.report.message.find("2 negative eigenvalues"), std::string::npos)
      << found.report.message;
}

/// A thousand extents of the structure away, and more.
TEST(BeamStatus, RelaxationIgnoresAnUnusedNodeFarAway) {
  BeamSolveOptions options;
  options.method = BeamMethod::kRelaxation;
  BeamModel model = cantilever_model(10, 1);
  const BeamSolution alone = find_equilibrium(BeamStructure(model), options);
  model.nodes.push_back({Eigen::Vector3d(5000, 0, 0)});
  const BeamSolution found = find_equilibrium(BeamStructure(model), options);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  // Equal but for starts that are moved on purpose, by shares of the extent.
  EXPECT_LE((found.state.positions.leftCols(11) - alone.state.positions).norm(),
            5e4 * start_shift());
}

/// Its nodes move along it only: nothing in the stiffness tells that elements buckle between them.
BeamModel pressed_between_nodes(double push) {
  BeamModel model = limber::testing::straight_beam(5, 1, 200);
  model.supports = {clamped(0), clamped(5)};
  model.supports[1].fixed[0] = false;
  for (int i = 1; i < 5; ++i) model.supports.push_back({i, {false, true, true, true, true, true}});
  PrescribedMotion motion;
  motion.node = 5;
  motion.translates = {true, false, false};
  motion.translation = {-push, 0, 0};
  model.motions.push_back(motion);
  return model;
}

TEST(BeamStatus, AnElementPressedBeyondItsOwnBucklingIsNoMinimum) {
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  const BeamSolution found = find_equilibrium(BeamStructure(pressed_between_nodes(0.3)), options);
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_NE(found.report.message.find("by itself"), std::string::npos) << found.report.message;
  EXPECT_FALSE(found.report.negative_eigenvalues.has_value());
}

/// EA / L = 40000 N/m over five elements of 4 pi^2 EI / l^2 = 987 N: once to twice that from pushes
/// of 0.0247 to 0.0493 m.
TEST(BeamStatus, AnElementPressedOnceToTwiceBeyondItsOwnBucklingIsNamed) {
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kChoose, BeamMethod::kRelaxation,
                                  BeamMethod::kRelaxationThenNewton}) {
    BeamSolveOptions options;
    options.method = method;
    for (const double push : {0.02, 0.03, 0.045}) {
      const BeamSolution found =
          find_equilibrium(BeamStructure(pressed_between_nodes(push)), options);
      SCOPED_TRACE(std::string(to_string(method)) + ": " + found.report.message);
      EXPECT_EQ(found.report.converged(), push < 0.0247) << push;
      EXPECT_EQ(found.report.unjudged_elements.empty(), push < 0.0247) << push;
    }
  }
}

/// What balances at the end of a branch is no equilibrium where elements do not resolve it.
TEST(BeamStatus, TheShareUpToWhichElementsResolveTheEquilibriumIsReported) {
  const BeamStructure structure(pressed_between_nodes(0.1));
  const BeamSolution found =
      follow_equilibrium(structure, structure.rest_state(), {}, BeamSolveOptions::following());
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_EQ(found.report.load_factor, 1);
  ASSERT_TRUE(found.report.equilibrium_share.has_value());
  EXPECT_NEAR(*found.report.equilibrium_share, 0.493, 0.01);
  EXPECT_NE(found.report.message.find("balanced at 100 %, but element"), std::string::npos)
      << found.report.message;
}

TEST(BeamStatus, AFoldedElementIsDoubted) {
  const BeamStructure structure(cantilever_model(4, 1));
  BeamState state = structure.rest_state();
  EXPECT_FALSE(detail::find_uncertain_element(structure, state));
  state.rotations[4] = Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitY());
  const auto doubt = detail::find_uncertain_element(structure, state);
  ASSERT_TRUE(doubt);
  EXPECT_EQ(doubt->element, 3);
  EXPECT_NE(doubt->message.find("folded"), std::string::npos) << doubt->message;
}

/// In a plane the moment rolls it up; in space nothing holds it there beyond a third of the path.
TEST(BeamStatus, ARollUpInSpaceIsUnstableAndSaysWhatToHold) {
  BeamModel model = limber::testing::straight_beam(20);
  model.supports.push_back(clamped(0));
  NodalLoad load;
  load.node = 20;
  load.moment = Eigen::Vector3d(0, -6.2832, 0);
  model.loads.push_back(load);
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << found.report.message;
  EXPECT_NE(found.report.message.find("hold"), std::string::npos) << found.report.message;
}

TEST(BeamStatus, LimitsAreLimits) {
  const BeamStructure structure(limber::testing::compressed_model(20, BeamEnds::kHinged, 0.3));
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  options.newton_iterations = 3;
  const BeamSolution newton = find_equilibrium(structure, options);
  EXPECT_EQ(newton.report.status, BeamStatus::kIterationLimit);
  EXPECT_LT(newton.report.load_factor, 1);
  options.method = BeamMethod::kRelaxation;
  options.relaxation_steps = 50;
  options.ramp_steps = 10;
  const BeamSolution relaxed = find_equilibrium(structure, options);
  EXPECT_EQ(relaxed.report.status, BeamStatus::kIterationLimit);
  EXPECT_GT(relaxed.report.residual, options.relaxation_tolerance);
}

TEST(BeamStatus, OptionsNameMemberAndRule) {
  const BeamStructure structure(limber::testing::cantilever_model(4, 1));
  const auto field_of = [&](auto&& spoil) -> std::string {
    BeamSolveOptions options;
    spoil(options);
    try {
      (void)find_equilibrium(structure, options);
    } catch (const Error& error) {
      return error.field();
    }
    return "accepted";
  };
  EXPECT_EQ(field_of([](auto& o) { o.tolerance = 0; }), "tolerance");
  EXPECT_EQ(field_of([](auto& o) { o.relaxation_tolerance = 2; }), "relaxation_tolerance");
  EXPECT_EQ(field_of([](auto& o) { o.newton_iterations = 0; }), "newton_iterations");
  EXPECT_EQ(field_of([](auto& o) { o.relaxation_steps = -1; }), "relaxation_steps");
  EXPECT_EQ(field_of([](auto& o) { o.ramp_steps = -1; }), "ramp_steps");
  EXPECT_EQ(field_of([](auto& o) { o.first_load_step = 1.5; }), "first_load_step");
  EXPECT_EQ(field_of([](auto& o) { o.hand_over = 0; }), "hand_over");
}

TEST(BeamStatus, AnElementThatIsBentTooFarIsReported) {
  // Four elements make a poor circle: their ends stand by 45 degrees against their chords.
  const BeamStructure structure(limber::testing::roll_up_model(4));
  const BeamSolution found = find_equilibrium(structure);
  EXPECT_GT(results_of(structure, found.state).largest_bend, 0.5);
  const BeamStructure fine(limber::testing::roll_up_model(20));
  EXPECT_LT(results_of(fine, find_equilibrium(fine).state).largest_bend, 0.2);
}

}  // namespace
}  // namespace limber::beams
