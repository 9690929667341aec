#include "engine/beams/solver/certificate.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "tests/support/beam_problems.h"

namespace limber::beams::detail {
namespace {

using limber::testing::clamped;
using limber::testing::straight_beam;

NodeLoads no_loads(const BeamStructure& structure) { return NodeLoads::of(structure.model()); }

/// A clamped column, straight under a multiple of the load that buckles it.
BeamReport pressed_column(double times) {
  constexpr double kSlenderness = 200;
  constexpr double kEuler = std::numbers::pi * std::numbers::pi / 4;  // EI / L^2
  BeamModel model = straight_beam(12, 1, kSlenderness);
  model.supports = {clamped(0)};
  model.loads = {{12, {-times * kEuler, 0, 0}}};
  const BeamStructure structure(model);
  BeamState state = structure.rest_state();
  const double strain = times * kEuler / model.sections[0].stretching;
  state.positions.row(0) *= 1 - strain;
  BeamReport report;
  report.status = BeamStatus::kConverged;
  certify(structure, {}, NodeLoads::of(structure.model()), state, report);
  return report;
}

/// It buckles at 1, 9, 25 ... times its Euler load, each time in two planes.
TEST(BeamCertificate, CountsTheModesInWhichAColumnHasBuckled) {
  const BeamReport below = pressed_column(0.95);
  EXPECT_EQ(below.status, BeamStatus::kConverged) << below.message;
  EXPECT_EQ(below.negative_eigenvalues, 0);
  EXPECT_GE(below.factorizations, 1);
  for (const auto& [times, expected] : {std::pair{1.05, 2}, {8.0, 2}, {10.0, 4}}) {
    const BeamReport above = pressed_column(times);
    EXPECT_EQ(above.status, BeamStatus::kUnstable) << times;
    EXPECT_EQ(above.negative_eigenvalues, expected) << times;
    EXPECT_NE(above.message.find("saddle"), std::string::npos) << above.message;
  }
  EXPECT_GE(pressed_column(1.05).node, 10);  // it moves most towards its tip, node 12
}

TEST(BeamCertificate, WhatNothingHoldsIsAMechanism) {
  BeamModel model = straight_beam(2);
  // Hinged at one end about y: the beam swings.
  model.supports = {{0, {true, true, true, true, false, true}}};
  const BeamStructure structure(model);
  BeamReport report;
  report.status = BeamStatus::kConverged;
  certify(structure, {}, no_loads(structure), structure.rest_state(), report);
  EXPECT_EQ(report.status, BeamStatus::kMechanism) << report.message;
  EXPECT_FALSE(report.negative_eigenvalues.has_value());
  EXPECT_NE(report.message.find("without any resistance"), std::string::npos) << report.message;
}

TEST(BeamCertificate, OfLoadsWithoutAPotentialDivergenceIsAllThatIsJudged) {
  BeamModel model = straight_beam(4);
  model.supports = {clamped(0)};
  NodalLoad load;
  load.node = 4;
  load.force = {0, 0, 1e-6};
  load.direction = LoadDirection::kFollowing;
  model.loads = {load};
  const BeamStructure structure(model);
  BeamReport report;
  report.status = BeamStatus::kConverged;
  certify(structure, {}, no_loads(structure), structure.rest_state(), report);
  EXPECT_EQ(report.status, BeamStatus::kConverged) << report.message;
  EXPECT_EQ(report.negative_eigenvalues, 0);
  EXPECT_NE(report.message.find("loads that follow have no potential"), std::string::npos)
      << report.message;
}

TEST(BeamCertificate, PlacesOfUnknownsInWords) {
  BeamModel model = straight_beam(2);
  model.supports = {clamped(0)};
  model.elements[1].start_release.rotations = {false, true, false};
  model.elements[0].finish_release.rotations = {true, true, true};
  const BeamStructure structure(model);
  EXPECT_EQ(location_text(structure, 12), "node 2 moves");
  EXPECT_EQ(location_text(structure, 14), "node 2 moves");
  EXPECT_EQ(location_text(structure, 15), "node 2 turns");
  EXPECT_EQ(location_text(structure, 17), "node 2 turns");
  int turning = 0;
  for (int unknown = 18; unknown < structure.unknowns(); ++unknown) {
    const std::string text = location_text(structure, unknown);
    EXPECT_TRUE(text == "the finish of element 0 turns" || text == "the start of element 1 turns")
        << text;
    turning += text == "the start of element 1 turns" ? 1 : 0;
  }
  EXPECT_EQ(structure.unknowns(), 22);
  EXPECT_EQ(turning, 1);
  EXPECT_EQ(location_text(structure, -1), "nowhere");
  EXPECT_EQ(location_text(structure, structure.unknowns()), "nowhere");
}

TEST(BeamCertificate, MomentsMatterWhereANodeTurnsAboutSeveralAxes) {
  BeamModel model = straight_beam(3);
  model.supports = {clamped(0), {1, {false, true, false, true, false, true}}};
  const BeamStructure structure(model);
  const auto turns = [&](int node) {
    Eigen::Matrix3Xd moments = Eigen::Matrix3Xd::Zero(3, 4);
    moments.col(node) << 0, 1e-9, 0;
    return turns_free_nodes(structure, moments);
  };
  EXPECT_FALSE(turns(0));
  EXPECT_FALSE(turns(1));
  EXPECT_TRUE(turns(2));
  EXPECT_FALSE(turns_free_nodes(structure, Eigen::Matrix3Xd::Zero(3, 4)));
}

TEST(BeamCertificate, ReportsSayWhatIsLeftAndWhere) {
  BeamModel model = straight_beam(2);
  model.supports = {clamped(0)};
  const BeamStructure structure(model);
  BeamReport report;
  report.residual = 0.02;
  report.load_factor = 0.5;
  report_status(structure, BeamStatus::kIterationLimit, 6 * 2 + 4, report);
  EXPECT_EQ(report.status, BeamStatus::kIterationLimit);
  EXPECT_EQ(report.node, 2);
  EXPECT_EQ(report.message, "residual 0.02 at load factor 0.5, worst where node 2 turns");
  report.residual = std::numeric_limits<double>::infinity();
  report_status(structure, BeamStatus::kIterationLimit, 6, report);
  EXPECT_NE(report.message.find("beyond all bounds"), std::string::npos) << report.message;
  EXPECT_NE(report.message.find("node 1 moves"), std::string::npos) << report.message;
  report.negative_eigenvalues = 1;
  report_status(structure, BeamStatus::kUnstable, 6, report);
  EXPECT_NE(report.message.find("1 negative eigenvalue,"), std::string::npos) << report.message;
  report_status(structure, BeamStatus::kConverged, -1, report);
  EXPECT_EQ(report.node, -1);
}

}  // namespace
}  // namespace limber::beams::detail
