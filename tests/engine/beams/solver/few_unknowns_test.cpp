// Structures of which nothing is free, or one direction only.

#include <gtest/gtest.h>

#include "engine/beams/refinement/discretisation_error.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_problems.h"

namespace limber::beams::few_unknowns_test {
namespace {

using limber::testing::clamped;

constexpr BeamMethod kMethods[] = {BeamMethod::kNewton, BeamMethod::kRelaxation,
                                   BeamMethod::kRelaxationThenNewton, BeamMethod::kChoose};

/// One member of 1 m between two clamps, drawn longer than it is at rest.
BeamModel tie(BeamKind kind = BeamKind::kBeam) {
  BeamModel model = limber::testing::straight_beam(1);
  model.elements[0].rest_length = 0.999;
  model.elements[0].kind = kind;
  model.supports = {clamped(0), clamped(1)};
  return model;
}

double tension(const BeamModel& model, const BeamState& state) {
  return results_of(BeamStructure(model), state).forces[0].axial;
}

TEST(BeamFewUnknowns, ATieBetweenTwoClampsHasItsForce) {
  for (const BeamKind kind : {BeamKind::kBeam, BeamKind::kCable}) {
    const BeamModel model = tie(kind);
    const double force = model.sections[0].stretching * 0.001 / 0.999;
    for (const BeamMethod method : kMethods) {
      BeamSolveOptions options;
      options.method = method;
      const BeamStructure structure(model);
      const BeamSolution found = find_equilibrium(structure, options);
      ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
      EXPECT_EQ(found.report.negative_eigenvalues, 0);
      EXPECT_NEAR(tension(model, found.state), force, 1e-9 * force);
      const BeamResults results = results_of(structure, found.state);
      EXPECT_NEAR(results.reaction_forces(0, 0), -force, 1e-9 * force);
      EXPECT_NEAR(results.reaction_forces(0, 1), force, 1e-9 * force);
    }
  }
}

TEST(BeamFewUnknowns, ClampsThatMoveTakeTheTieAlong) {
  BeamModel model = tie();
  model.elements[0].rest_length = 0;
  BeamSolution at = find_equilibrium(BeamStructure(model));
  model.supports.pop_back();
  PrescribedMotion motion;
  motion.node = 1;
  motion.translates = motion.rotates = {true, true, true};
  for (const double stretch : {0.002, -2e-5, 0.0}) {
    motion.translation = {stretch, 0, 0};
    model.motions = {motion};
    const double force = model.sections[0].stretching * stretch;
    for (const bool live : {true, false}) {
      const BeamStructure structure(model);
      at = live ? follow_equilibrium(structure, at.state, {}, BeamSolveOptions::following())
                : find_equilibrium(structure);
      ASSERT_TRUE(at.report.converged()) << stretch << ": " << at.report.message;
      EXPECT_NEAR(tension(model, at.state), force, 1e-9 * model.sections[0].stretching) << stretch;
    }
  }
}

TEST(BeamFewUnknowns, OneDirectionIsFree) {
  // A slide between two clamps of a bar of two parts; pushed along it, or turned about it.
  for (const std::size_t free : {0U, 3U}) {
    BeamModel model = limber::testing::straight_beam(2);
    model.supports = {clamped(0), clamped(1), clamped(2)};
    model.supports[1].fixed[free] = false;
    const double stiffness =
        2 * (free == 0 ? model.sections[0].stretching : model.sections[0].torsion) / 0.5;
    NodalLoad load;
    load.node = 1;
    (free == 0 ? load.force : load.moment).x() = 1e-5 * stiffness;
    model.loads = {load};
    for (const BeamMethod method : kMethods) {
      BeamSolveOptions options;
      options.method = method;
      const BeamSolution found = find_equilibrium(BeamStructure(model), options);
      ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
      const double went =
          free == 0 ? found.state.positions(0, 1) - 0.5 : 2 * found.state.rotations[1].x();
      EXPECT_NEAR(went, 1e-5, 1e-10) << to_string(method);
    }
  }
}

TEST(BeamFewUnknowns, LoadsThatFollowAndNothingFree) {
  BeamModel model = tie();
  model.loads = {{1, {0, 0, 5}, {0, 0, 0}, LoadDirection::kFollowing}};
  for (const BeamMethod method : kMethods) {
    BeamSolveOptions options;
    options.method = method;
    const BeamSolution found = find_equilibrium(BeamStructure(model), options);
    EXPECT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
  }
}

TEST(BeamFewUnknowns, TheErrorOfItsElementsIsEstimated) {
  const BeamModel model = tie();
  const Subdivision whole = Subdivision::even(model, 1);
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  const DiscretisationEstimate estimate =
      estimate_discretisation(model, {whole, found.state}, 64, {});
  EXPECT_TRUE(estimate.error.is_known) << estimate.error.message;
  EXPECT_LT(estimate.error.position_error, 1e-9);
}

}  // namespace
}  // namespace limber::beams::few_unknowns_test
