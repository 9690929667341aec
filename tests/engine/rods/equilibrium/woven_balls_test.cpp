// Great circles woven to a ball: each is a circle of the length of its segments, 2 pi^2 E I / L.

#include <gtest/gtest.h>

#include <numbers>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/section/section.h"
#include "tests/engine/rods/linkage/weaves.h"

namespace limber::rods {
namespace {

TEST(WovenBalls, HaveTheEnergyOfTheirCircles) {
  for (const int circles : {3, 4, 6}) {
    const LineMesh mesh = testing::great_circles(testing::regular_axes(circles));
    const SectionStiffness section =
        section_stiffness(section_properties(Rectangle{0.02, 0.02}), {1e9, 0.3});
    const LinkageModel model(
        build_linkage_graph(mesh), 12,
        {section.stretching, section.bending_1, section.bending_2, section.torsion});
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    const EquilibriumReport report = equilibrium.solve(state, {});
    ASSERT_TRUE(report.converged()) << report.message;
    const double length = model.segment_lengths().sum() / circles;
    const double right =
        circles * 2 * std::numbers::pi * std::numbers::pi * section.bending_2 / length;
    EXPECT_NEAR(report.energies.total(), right, 2e-3 * right) << circles << " circles";
    EXPECT_NEAR(report.energies.bending, right, 2e-3 * right) << circles << " circles";
    // Nothing holds the ball in place; its joints lie opposite to each other.
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const auto& joint : state.joints()) centre += joint.position;
    centre /= static_cast<double>(state.joints().size());
    for (const auto& joint : state.joints())
      EXPECT_NEAR((joint.position - centre).norm(), length / (2 * std::numbers::pi), 2e-3 * length);
  }
}

}  // namespace
}  // namespace limber::rods
