#include "engine/beams/solver/taut_cables.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_problems.h"

namespace limber::beams::taut_cables_test {
namespace {

using Eigen::Vector3d;
using limber::testing::clamped;

constexpr BeamMethod kMethods[] = {BeamMethod::kNewton, BeamMethod::kRelaxation,
                                   BeamMethod::kRelaxationThenNewton, BeamMethod::kChoose};
constexpr double kPost = 2e4, kCable = 1e4;  // E A [N]

void add_cable(BeamModel& model, int start, int finish) {
  BeamElement cable;
  cable.start = start;
  cable.finish = finish;
  cable.section = 1;
  cable.kind = BeamKind::kCable;
  model.elements.push_back(cable);
}

/// Bays beside each other in the plane of x and z: hinged posts and beams, 2 m by 2 m.
BeamModel bays(int count) {
  BeamModel model;
  model.sections = {{kPost, 100, 100, 100}, {kCable}};
  for (int i = 0; i <= count; ++i) {
    for (const double z : {0.0, 2.0}) model.nodes.push_back({{2.0 * i, 0, z}, {0, 1, 0}});
    model.supports.push_back(clamped(2 * i));
    model.supports.push_back({2 * i + 1, {false, true, false, true, false, true}});
    BeamElement post;
    post.start = 2 * i;
    post.finish = 2 * i + 1;
    post.start_release.rotations = {false, true, true};
    model.elements.push_back(post);
  }
  for (int i = 0; i < count; ++i) {
    BeamElement beam;
    beam.start = 2 * i + 1;
    beam.finish = 2 * i + 3;
    beam.start_release.rotations = beam.finish_release.rotations = {false, true, true};
    model.elements.push_back(beam);
  }
  return model;
}

BeamSolution solve(const BeamModel& model, BeamMethod method = BeamMethod::kChoose) {
  BeamSolveOptions options;
  options.method = method;
  return find_equilibrium(BeamStructure(model), options);
}

TEST(BeamTautCables, ABayWithBothDiagonalsStandsUnloaded) {
  BeamModel model = bays(1);
  add_cable(model, 0, 3);
  add_cable(model, 1, 2);
  for (const BeamMethod method : kMethods) {
    const BeamSolution found = solve(model, method);
    EXPECT_EQ(found.report.status, BeamStatus::kConverged)
        << to_string(method) << ": " << found.report.message;
    EXPECT_LT((found.state.positions - BeamStructure(model).rest_state().positions).norm(), 1e-12);
  }
}

TEST(BeamTautCables, ABayWithOneDiagonalFallsToTheOtherSide) {
  for (const auto& [start, finish] : {std::pair{0, 3}, std::pair{1, 2}}) {
    BeamModel model = bays(1);
    add_cable(model, start, finish);
    for (const BeamMethod method : kMethods)
      EXPECT_EQ(solve(model, method).report.status, BeamStatus::kMechanism) << to_string(method);
  }
}

/// Every bay has one diagonal, and their directions differ: together they hold to both sides.
TEST(BeamTautCables, DiagonalsOfDifferentBaysBraceEachOther) {
  BeamModel model = bays(3);
  add_cable(model, 0, 3);
  add_cable(model, 5, 6);
  EXPECT_TRUE(solve(model).report.converged()) << solve(model).report.message;
  BeamModel same = bays(3);
  add_cable(same, 0, 3);
  add_cable(same, 4, 7);
  EXPECT_EQ(solve(same).report.status, BeamStatus::kMechanism);
}

TEST(BeamTautCables, ThreeGuysHoldAMastAndTwoDoNot) {
  for (const int guys : {2, 3, 5}) {
    BeamModel model;
    model.sections = {{kPost, 100, 100, 100}, {kCable}};
    model.nodes = {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 3}, {1, 0, 0}}};
    BeamElement mast;
    mast.finish = 1;
    mast.start_release.rotations = {false, true, true};
    model.elements = {mast};
    model.supports = {clamped(0)};
    for (int i = 0; i < guys; ++i) {
      const double angle = 0.3 + 2 * M_PI * i / guys;
      model.nodes.push_back({{2 * std::cos(angle), 2 * std::sin(angle), 0}});
      model.supports.push_back({i + 2, {true, true, true}});
      add_cable(model, i + 2, 1);
    }
    const BeamSolution found = solve(model);
    EXPECT_EQ(found.report.converged(), guys > 2) << guys << ": " << found.report.message;
    EXPECT_EQ(found.report.status == BeamStatus::kMechanism, guys == 2) << guys;
  }
}

/// Pushed to one side, let go, pushed to the other: the diagonal that is pulled carries
/// F sqrt(2).
TEST(BeamTautCables, LiveEditsPassThroughTheUnloadedBay) {
  BeamModel model = bays(1);
  add_cable(model, 0, 3);
  add_cable(model, 1, 2);
  BeamSolution at = solve(model);
  for (const double force : {5.0, 0.0, -5.0, 0.0, 0.0, 5.0}) {
    model.loads = {{3, {force, 0, 0}}};
    const BeamStructure structure(model);
    at = follow_equilibrium(structure, at.state, {}, BeamSolveOptions::following());
    ASSERT_TRUE(at.report.converged()) << force << ": " << at.report.message;
    const BeamResults results = results_of(structure, at.state);
    const double pulled = std::sqrt(2) * std::abs(force);
    EXPECT_NEAR(results.forces[3].axial, force > 0 ? pulled : 0, 0.01) << force;
    EXPECT_NEAR(results.forces[4].axial, force < 0 ? pulled : 0, 0.01) << force;
    const BeamSolution fresh = solve(model);
    EXPECT_LT((at.state.positions - fresh.state.positions).norm(), 1e-7) << force;
  }
}

/// A frame with stiff corners stands without its cables.
TEST(BeamTautCables, WhatStandsWithoutThemStandsWithThem) {
  for (const int count : {1, 1100}) {
    BeamModel model = bays(count);
    for (BeamElement& e : model.elements) e.start_release = e.finish_release = {};
    for (int i = 0; i < count; ++i) add_cable(model, 2 * i, 2 * i + 3);
    const BeamSolution found = solve(model);
    EXPECT_TRUE(found.report.converged()) << count << ": " << found.report.message;
  }
}

}  // namespace
}  // namespace limber::beams::taut_cables_test
