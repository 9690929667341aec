// Equilibria of linkages with very short segments and of very slender rods.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::kStrip;

/// A grid that is held at a joint and pulled up at another one.
struct Pulled {
  Pulled(const LineMesh& mesh, int at, double last_column_scale)
      : model(build_linkage_graph(mesh), 6, kStrip) {
    Eigen::VectorXd scales = Eigen::VectorXd::Ones(model.variables().segments());
    for (int s = 0; s < model.variables().segments(); ++s) {
      const auto& ends = model.graph().segments[s].vertices;
      if (ends[0] % 3 == 2 && ends[1] % 3 == 2) scales[s] = last_column_scale;
    }
    if (last_column_scale != 1) model.set_section_scales(scales);
    Conditions conditions;
    conditions.pins = {{0}};
    conditions.springs = {
        {JointPoint{at}, state.joints()[at].position + Eigen::Vector3d(0, 0, 10), 0.5}};
    LinkageEquilibrium equilibrium(model);
    report = equilibrium.solve(state, conditions);
  }
  LinkageModel model;
  LinkageState state{model};
  EquilibriumReport report;
};

TEST(ExtremeSizes, SegmentsShorterThanAThousandthOfTheRestChangeNothing) {
  // Two columns that short segments join bend as one of twice the stiffness: E I goes with the
  // fourth power of what scales a section.
  const Pulled without(testing::sheared_grid(3, 3, 1.0, 40), 5, std::pow(2.0, 0.25));
  ASSERT_TRUE(without.report.converged()) << without.report.message;
  const double energy = without.report.energies.total();
  ASSERT_GT(energy, 0.1);
  for (const double apart : {0.4, 0.1, 0.03, 0.02}) {
    LineMesh mesh = testing::sheared_grid(4, 3, 1.0, 40);
    for (int r = 0; r < 3; ++r)
      mesh.vertices.col(4 * r + 3) = mesh.vertices.col(4 * r + 2) + Eigen::Vector3d(apart, 0, 0);
    const Pulled with(mesh, 6, 1);
    ASSERT_TRUE(with.report.converged()) << apart << ": " << with.report.message;
    // Columns lie that far apart. Edges of rods at short segments are short, too: of what six
    // edges for each segment are off by, 1e-3, a part goes.
    EXPECT_NEAR(with.report.energies.total(), energy, 3e-4 * energy) << apart;
    for (int j = 0; j < 12; ++j) {
      const Eigen::Vector3d same =
          without.state.joints()[3 * (j / 4) + std::min(j % 4, 2)].position;
      EXPECT_LT((with.state.joints()[j].position - same).norm(), 1e-3 + 1.01 * apart)
          << apart << ", joint " << j;
    }
  }
}

TEST(ExtremeSizes, SlendernessFromTenToTenThousand) {
  std::vector<double> energies;  // over E I
  const std::vector<double> slenderness{10, 100, 1000, 10000};
  for (const double cells_over_height : slenderness) {
    const double h = 40 / cells_over_height, young = 3000, shear = young / 2.76;  // of squares
    const double bending = young * std::pow(h, 4) / 12;
    const LinkageModel model = testing::curved_model(
        1, {young * h * h, bending, bending, 0.1406 * shear * std::pow(h, 4)});
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    Conditions conditions;
    conditions.pins = {{5}};
    conditions.mean_opening_angle = state.mean_opening_angle();
    const EquilibriumReport drawn = equilibrium.solve(state, conditions);
    ASSERT_TRUE(drawn.converged()) << cells_over_height << ": " << drawn.message;
    const double wanted = state.mean_opening_angle() + 0.5;
    conditions.mean_opening_angle = wanted;
    const DeploymentReport report = deploy(equilibrium, state, conditions);
    EXPECT_EQ(report.status, DeploymentStatus::kReached)
        << cells_over_height << ": " << report.message;
    EXPECT_TRUE(report.end.converged()) << cells_over_height << ": " << report.end.message;
    EXPECT_EQ(report.steps_failed + report.steps_shortened + report.jumps, 0) << cells_over_height;
    EXPECT_NEAR(state.mean_opening_angle(), wanted, 1e-12);
    energies.push_back(report.end.energies.total() / bending);
  }
  // Stretching yields by what E A is short of rigid: E I / E A = h^2 / 12.
  for (std::size_t k = 0; k + 1 < slenderness.size(); ++k) {
    const double less = 1 - energies[k] / energies.back();
    EXPECT_NEAR(less * slenderness[k] * slenderness[k], 0.78, 0.05) << slenderness[k];
  }
}

}  // namespace
}  // namespace limber::rods
