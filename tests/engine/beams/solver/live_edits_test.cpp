// Equilibria that are followed within a bound of work, ends of branches located roughly.

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_grid.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::cantilever_model;
using limber::testing::clamped;
using limber::testing::pressed_cantilever;
using limber::testing::shallow_arch;

/// As of a large structure.
BeamSolveOptions coarse() {
  BeamSolveOptions options = BeamSolveOptions::live(1000);
  options.factorizations = 0;
  return options;
}

BeamSolution follow_live(const BeamModel& model, const BeamState& start,
                         const BeamSolveOptions& options = coarse()) {
  return follow_equilibrium(BeamStructure(model), start, {}, options);
}

TEST(BeamLiveEdits, AnArchThatSnapsThroughIsReportedWithAPlaceGoodToTheResolution) {
  const BeamSolution first = find_equilibrium(BeamStructure(shallow_arch(5)));
  const BeamSolution live = follow_live(shallow_arch(25), first.state);
  const BeamSolution fine = follow_equilibrium(BeamStructure(shallow_arch(25)), first.state, {},
                                               BeamSolveOptions::following());
  ASSERT_TRUE(live.report.converged()) << live.report.message;
  ASSERT_TRUE(fine.report.converged()) << fine.report.message;
  EXPECT_LT((live.state.positions - fine.state.positions).norm(), 1e-6);
  ASSERT_EQ(live.report.snaps.size(), 1U);
  ASSERT_EQ(fine.report.snaps.size(), 1U);
  const double resolution = coarse().snap_resolution;
  EXPECT_NEAR(live.report.snaps[0].load_factor, fine.report.snaps[0].load_factor, 2 * resolution);
  EXPECT_GT(live.report.snaps[0].turn, 0.1);
  EXPECT_LT(live.report.factorizations, fine.report.factorizations);
}

/// The step across the buckling load is long, but taken back it leads back.
TEST(BeamLiveEdits, AColumnThatBucklesDoesNotSnap) {
  const BeamSolution first = find_equilibrium(BeamStructure(pressed_cantilever(1)));
  ASSERT_TRUE(first.report.converged());
  const BeamSolution found = follow_live(pressed_cantilever(3.5), first.state);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_GT(found.state.positions(2, 16), 0.5) << "to the side that the load pushes to";
  EXPECT_TRUE(found.report.snaps.empty());
}

TEST(BeamLiveEdits, WorkThatIsUsedUpEndsWithTheShareThatWasReached) {
  BeamModel model = cantilever_model(20, 1);
  const BeamSolution first = find_equilibrium(BeamStructure(model));
  model.loads[0].force.z() = 10;
  BeamSolveOptions options = coarse();
  options.method = BeamMethod::kNewton;
  BeamSolution found;
  for (options.factorizations = 40; found.report.load_factor == 0; options.factorizations += 20)
    found = follow_live(model, first.state, options);
  options.factorizations -= 20;
  EXPECT_EQ(found.report.status, BeamStatus::kIterationLimit);
  EXPECT_GT(found.report.load_factor, 0);
  EXPECT_LT(found.report.load_factor, 1);
  EXPECT_LE(found.report.factorizations, options.factorizations + 5);  // those of an iteration
  // It is the equilibrium at that share.
  BeamModel reached = model;
  reached.loads[0].force.z() = 1 + 9 * found.report.load_factor;
  const BeamSolution there = find_equilibrium(BeamStructure(reached));
  EXPECT_LT((there.state.positions - found.state.positions).norm(), 1e-5);
  options.factorizations = 0;
  EXPECT_TRUE(follow_live(model, first.state, options).report.converged());
}

TEST(BeamLiveEdits, WorkIsBoundedByTheNumberOfElements) {
  // Small structures have the bounds of any solve, which are wider.
  const BeamSolveOptions small = BeamSolveOptions::live(100).bounded_by_size(100);
  const BeamSolveOptions large = BeamSolveOptions::live(10000);
  EXPECT_GT(BeamSolveOptions::live(1000).factorizations, large.factorizations);
  EXPECT_GT(small.factorizations, large.factorizations);
  EXPECT_GT(small.relaxation_steps, large.relaxation_steps);
  EXPECT_LT(small.snap_resolution, large.snap_resolution);
  const BeamSolveOptions chosen = BeamSolveOptions{}.bounded_by_size(10000);
  EXPECT_GT(chosen.factorizations, 0);
  EXPECT_LE(chosen.relaxation_steps, 20000);
  EXPECT_EQ(BeamSolveOptions{}.bounded_by_size(100).relaxation_steps,
            BeamSolveOptions{}.relaxation_steps);
}

/// Rods so slender that they hang like cables.
TEST(BeamLiveEdits, AGridOfSlenderRodsUnderItsOwnWeightTakesBoundedWork) {
  limber::testing::BeamGrid grid;
  grid.nodes = 15;
  grid.radius = 0.002;
  const BeamStructure structure(limber::testing::beam_grid(grid));
  const BeamSolution found = find_equilibrium(structure);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_EQ(found.report.negative_eigenvalues.value_or(-1), 0);
  EXPECT_LT(found.state.positions.row(2).minCoeff(), -0.1) << "it hangs";
  // Five times what it takes; the bound by size is thousands.
  EXPECT_LE(found.report.factorizations, 200);
  EXPECT_EQ(found.report.relaxation_steps, 0);

  BeamSolveOptions options = BeamSolveOptions::live(structure.elements());
  options.factorizations = found.report.factorizations / 2;
  options.method = BeamMethod::kNewton;
  const BeamSolution less = find_equilibrium(structure, options);
  EXPECT_EQ(less.report.status, BeamStatus::kIterationLimit) << less.report.message;
  EXPECT_LT(less.report.load_factor, 1);
  EXPECT_LE(less.report.factorizations, options.factorizations + 5);  // those of an iteration
}

TEST(BeamLiveEdits, ResolutionAndBoundOfWorkAreValidated) {
  BeamSolveOptions options;
  options.snap_resolution = 0;
  EXPECT_THROW(options.validate(), Error);
  options = {};
  options.factorizations = -1;
  EXPECT_THROW(options.validate(), Error);
}

}  // namespace
}  // namespace limber::beams
