// Equilibria that are followed from one to the next: loads, supports and motions that change.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::ArchMoves;
using limber::testing::cantilever_model;
using limber::testing::clamped;
using limber::testing::pressed_cantilever;
using limber::testing::shallow_arch;
using limber::testing::straight_beam;

BeamSolveOptions watched() {
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  options.newton_iterations = 4000;
  options.largest_swerve = 0.05;
  return options;
}

BeamSolution follow(const BeamModel& model, const BeamState& start,
                    const std::vector<HeldTurn>& turned = {}, const BeamObserver& observer = {}) {
  return follow_equilibrium(BeamStructure(model), start, turned, watched(), {}, observer);
}

/// Distance of the farthest node.
double apart(const BeamState& a, const BeamState& b) {
  return (a.positions - b.positions).colwise().norm().maxCoeff();
}

TEST(BeamFollowing, ALoadThatChangesLeadsToTheKnownAnswerInSmallSteps) {
  BeamModel model = cantilever_model(20, 3);
  const BeamSolution first = find_equilibrium(BeamStructure(model));
  model.loads[0].force.z() = 10;
  double height = first.state.positions(2, 20);
  int steps = 0;
  const BeamSolution found = follow(model, first.state, {}, [&](const BeamProgress& progress) {
    EXPECT_GT(progress.state->positions(2, 20), height) << "loads do not start again from nothing";
    height = progress.state->positions(2, 20);
    ++steps;
  });
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_NEAR(found.state.positions(2, 20), .81061, 2e-5);
  EXPECT_NEAR(found.state.positions(0, 20), 1 - .55500, 2e-5);
  EXPECT_TRUE(found.report.snaps.empty());
  EXPECT_GE(steps, 3);
}

TEST(BeamFollowing, NothingChangedIsNothingMoved) {
  const BeamModel model = cantilever_model(12, 5);
  const BeamSolution first = find_equilibrium(BeamStructure(model));
  const BeamSolution again = follow(model, first.state);
  ASSERT_TRUE(again.report.converged());
  EXPECT_LE(again.report.load_steps, 1);
  EXPECT_LT(apart(again.state, first.state), 1e-7);
}

TEST(BeamFollowing, ASnapIsReportedWithItsPlace) {
  const BeamSolution first = find_equilibrium(BeamStructure(shallow_arch(5)));
  ASSERT_TRUE(first.report.converged());
  const BeamSolution before = follow(shallow_arch(7), first.state);
  ASSERT_TRUE(before.report.converged()) << before.report.message;
  EXPECT_TRUE(before.report.snaps.empty());
  EXPECT_GT(before.state.positions(2, 8), 0.03);
  const BeamSolution after = follow(shallow_arch(25), first.state);
  ASSERT_TRUE(after.report.converged()) << after.report.message;
  EXPECT_LT(after.state.positions(2, 8), -0.03);
  ASSERT_EQ(after.report.snaps.size(), 1U);
  const BeamSnap snap = after.report.snaps[0];
  EXPECT_GT(snap.turn, 0.1);
  EXPECT_TRUE(snap.node > 0 && snap.node < 16) << snap.node;
  // It is where one-shot solves begin to end below, too.
  const double load = 5 + 20 * snap.load_factor;
  EXPECT_GT(find_equilibrium(BeamStructure(shallow_arch(load - 0.4))).state.positions(2, 8), 0);
  EXPECT_LT(find_equilibrium(BeamStructure(shallow_arch(load + 0.1))).state.positions(2, 8), 0);
  // Without its load it comes back in another snap.
  const BeamSolution back = follow(shallow_arch(0), after.state);
  ASSERT_TRUE(back.report.converged()) << back.report.message;
  EXPECT_LT(apart(back.state, BeamStructure(shallow_arch(0)).rest_state()), 1e-6);
  EXPECT_EQ(back.report.snaps.size(), 1U);
}

/// As stiff sideways as it is upright, it buckles to the side before it would snap through.
TEST(BeamFollowing, AnArchInSpaceRollsSidewaysWithoutASnap) {
  const BeamSolution first = find_equilibrium(BeamStructure(shallow_arch(5, ArchMoves::kInSpace)));
  double aside = 0;
  const BeamSolution after =
      follow(shallow_arch(25, ArchMoves::kInSpace), first.state, {}, [&](const BeamProgress& p) {
        aside = std::max(aside, p.state->positions.row(1).cwiseAbs().maxCoeff());
      });
  ASSERT_TRUE(after.report.converged()) << after.report.message;
  EXPECT_LT(after.state.positions(2, 8), -0.03);
  EXPECT_GT(aside, 0.03);
  EXPECT_TRUE(after.report.snaps.empty());
}

TEST(BeamFollowing, AColumnThatBucklesDoesNotSnap) {
  const BeamSolution first = find_equilibrium(BeamStructure(pressed_cantilever(1)));
  ASSERT_TRUE(first.report.converged());
  const BeamSolution found = follow(pressed_cantilever(3.5), first.state);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_GT(found.state.positions(2, 16), 0.5);
  EXPECT_TRUE(found.report.snaps.empty());
}

TEST(BeamFollowing, WhatASupportGaveFadesWhenItGoes) {
  BeamModel model = cantilever_model(16, 4);
  model.supports.push_back({16, {false, false, true, false, false, false}});
  const BeamSolution propped = find_equilibrium(BeamStructure(model));
  ASSERT_NEAR(propped.state.positions(2, 16), 0, 1e-12);
  model.supports.pop_back();
  double height = 0;
  const BeamSolution found = follow(model, propped.state, {}, [&](const BeamProgress& progress) {
    EXPECT_GT(progress.state->positions(2, 16), height);
    EXPECT_LT(progress.state->positions(2, 16) - height, 0.3) << "not all at once";
    height = progress.state->positions(2, 16);
  });
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_NEAR(found.state.positions(2, 16), 0.32894 * 2, 0.05);
  const BeamSolution fresh = find_equilibrium(BeamStructure(model));
  EXPECT_LT(apart(found.state, fresh.state), 1e-6);
}

TEST(BeamFollowing, PrescribedRotationsOfMoreThanATurnContinueFromWhereTheyAre) {
  BeamModel model = straight_beam(40, 1, 1e3);
  model.sections[0].torsion = model.sections[0].bending_3 = 50;  // it stays in its plane
  model.supports = {clamped(0)};
  PrescribedMotion motion;
  motion.node = 40;
  motion.rotates = {true, true, true};
  motion.rotation = {0, -2 * std::numbers::pi, 0};
  model.motions = {motion};
  const BeamState rest = BeamStructure(model).rest_state();
  const BeamSolution rolled = follow(model, rest, {{40, Eigen::Vector3d::Zero()}});
  ASSERT_TRUE(rolled.report.converged()) << rolled.report.message;
  EXPECT_LT(rolled.state.positions.col(40).norm(), 0.01) << "a closed circle";
  // On by half a turn, and back.
  model.motions[0].rotation.y() = -3 * std::numbers::pi;
  const BeamSolution more = follow(model, rolled.state, {{40, {0, -2 * std::numbers::pi, 0}}});
  ASSERT_TRUE(more.report.converged()) << more.report.message;
  const double radius = 1 / (3 * std::numbers::pi);
  EXPECT_NEAR(more.state.positions(2, 40), 2 * radius, 0.01);
  model.motions[0].rotation.setZero();
  const BeamSolution back = follow(model, more.state, {{40, {0, -3 * std::numbers::pi, 0}}});
  ASSERT_TRUE(back.report.converged()) << back.report.message;
  EXPECT_LT(apart(back.state, rest), 1e-5);
}

TEST(BeamFollowing, AWatchThatAsksForNothingSensibleIsRefused) {
  BeamSolveOptions options;
  options.largest_swerve = -1;
  EXPECT_ANY_THROW(options.validate());
}

}  // namespace
}  // namespace limber::beams
