// Measures of linkages whose sections are scaled.
#include "engine/rods/equilibrium/unknown_scales.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::curved_model;
using testing::kStrip;

/// E A with the square of the scale, everything else with the fourth power.
RodStiffness scaled(double scale) {
  const double area = scale * scale;
  return {kStrip.stretching * area, kStrip.bending_1 * area * area, kStrip.bending_2 * area * area,
          kStrip.torsion * area * area};
}

TEST(UnknownScales, ScaledSectionsAreMeasuredAsTheStifferRodsTheyMake) {
  constexpr double kScale = 3;
  LinkageModel model = curved_model();
  model.set_section_scales(Eigen::VectorXd::Constant(model.variables().segments(), kScale));
  const detail::UnknownScales mine(model), theirs(curved_model(1, scaled(kScale)));
  const auto same = [](double a, double b) { EXPECT_NEAR(a, b, 1e-12 * b); };
  same(mine.softest_eigenvalue(), theirs.softest_eigenvalue());
  same(mine.stiffest_eigenvalue(), theirs.stiffest_eigenvalue());
  same(mine.rounding_shift(), theirs.rounding_shift());
  same(mine.force_rounding(), theirs.force_rounding());
  same(mine.energy_rounding(), theirs.energy_rounding());
  EXPECT_LT((mine.weights() - theirs.weights()).norm(), 1e-12 * theirs.weights().norm());
}

TEST(UnknownScales, SolverMeasuresSectionsThatWereScaledAfterItWasMade) {
  constexpr double kThin = 0.1;
  // By material frames: by turning angles rounding decides about ten of the 47 steps along a flat
  // valley, and about the seventh digit of where they end.
  const LinkageGraph graph = curved_model().graph();
  const LinkageModel thin(graph, 6, scaled(kThin), BendingForm::kMaterialFrames);
  LinkageModel model(graph, 6, kStrip, BendingForm::kMaterialFrames);
  LinkageEquilibrium equilibrium(model), other(thin);
  LinkageState mine(model), theirs(thin);
  Conditions conditions;
  conditions.pins = {{0}};
  conditions.mean_opening_angle = mine.mean_opening_angle() + 0.02;
  model.set_section_scales(Eigen::VectorXd::Constant(model.variables().segments(), kThin));
  const EquilibriumOptions exact{.tolerance = 1e-10};
  const EquilibriumReport report = equilibrium.solve(mine, conditions, exact);
  const EquilibriumReport expected = other.solve(theirs, conditions, exact);
  ASSERT_TRUE(expected.converged()) << expected.message;
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_NEAR(report.iterations, expected.iterations, 2);  // last digits of the stiffness differ
  EXPECT_LT(testing::joint_distance(mine, theirs), 1e-7);
}

}  // namespace
}  // namespace limber::rods
