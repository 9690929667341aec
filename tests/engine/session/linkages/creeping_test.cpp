#include <gtest/gtest.h>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {
namespace {

/// The drawn dome, flat and too long in the middle, is pressed in its plane: its forces keep that
/// symmetry, and steps that follow them alone creep up to the flat saddle for hundreds of
/// iterations.
TEST(LinkageEquilibrium, SymmetricShapesDoNotCreepUpToSaddles) {
  const MappedLinkage mapped = map_linkage(scene::make_linkage_sample("dome"));
  rods::LinkageEquilibrium equilibrium(mapped.model);
  rods::LinkageState state(mapped.model);
  rods::Conditions conditions;
  conditions.pins = {{40, rods::Hold::kMotion}};
  const rods::EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_GE(report.escapes, 1);
  EXPECT_LT(report.iterations, 60);  // 23; without looking for a descent direction more than 200
}

TEST(LinkageEquilibrium, WithoutEscapesCreepingIsASaddle) {
  const MappedLinkage mapped = map_linkage(scene::make_linkage_sample("dome"));
  rods::LinkageEquilibrium equilibrium(mapped.model);
  rods::LinkageState state(mapped.model);
  rods::Conditions conditions;
  conditions.pins = {{40, rods::Hold::kMotion}};
  const rods::EquilibriumReport report =
      equilibrium.solve(state, conditions, {.max_iterations = 200, .max_escapes = 0});
  EXPECT_EQ(report.status, rods::EquilibriumStatus::kSaddle) << report.message;
  EXPECT_LT(report.iterations, 60);
}

}  // namespace
}  // namespace limber::session
