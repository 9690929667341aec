// Estimates of the discretisation error against known answers and against much finer edges.

#include "engine/rods/equilibrium/discretisation_error.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_strains.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/support/solved_linkages.h"

namespace limber::rods {
namespace {

using testing::estimate_of;
using testing::SolvedLinkage;
using testing::TrueLinkageError;

SolvedLinkage found(SolvedLinkage given) {
  EXPECT_TRUE(given.is_found);
  return given;
}
SolvedLinkage cantilever(int edges, double alpha, BendingForm form) {
  return found(testing::cantilever_linkage(edges, alpha, form));
}
double height_of(const SolvedLinkage& given) {
  double height = 0;
  for (int i = 0; i <= given.model.variables().edges(0); ++i)
    height = std::max(height, std::abs(given.state.vertex(given.model, 0, i).y()));
  return height;
}
TrueLinkageError truth_of(const SolvedLinkage& given) {
  const auto error = testing::true_error(given);
  EXPECT_TRUE(error);
  return error.value_or(TrueLinkageError());
}

void expect_within_a_factor_of_3(double estimate, double truth, const std::string& what) {
  EXPECT_GT(estimate, truth / 3) << what;
  EXPECT_LT(estimate, truth * 3) << what;
}

class DiscretisationErrors : public ::testing::TestWithParam<BendingForm> {};

TEST_P(DiscretisationErrors, CantileverUnderATipLoad) {
  const Eigen::Vector3d tip(1 - 0.55500, 0.81061, 0);  // alpha = 10
  for (const int edges : {3, 5, 10, 20, 40}) {
    const SolvedLinkage given = cantilever(edges, 10, GetParam());
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueLinkageError truth = truth_of(given);
    expect_within_a_factor_of_3(error.max_distance, (given.state.joints()[1].position - tip).norm(),
                                name);
    expect_within_a_factor_of_3(error.max_distance, truth.distance, name);
    expect_within_a_factor_of_3(error.energy_error, truth.energy, name);
    EXPECT_EQ(error.worst_segment, 0);
    EXPECT_GE(error.worst_joint, 0);
    EXPECT_EQ(error.edges, 5 * edges);
    EXPECT_EQ(error.compared_edges, 10 * edges - 1);
  }
}

TEST_P(DiscretisationErrors, ElasticaBetweenHeldEnds) {
  for (const int edges : {10, 20, 40}) {
    const SolvedLinkage given = found(testing::elastica_linkage(edges, GetParam()));
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueLinkageError truth = truth_of(given);
    expect_within_a_factor_of_3(error.max_distance, truth.distance, name);
    expect_within_a_factor_of_3(error.energy_error, truth.energy, name);
    // What it is an error of: the height of the table.
    EXPECT_NEAR(height_of(given), 0.399731, 3 * error.max_distance) << name;
    EXPECT_GT(error.max_distance, std::abs(height_of(given) - 0.399731) / 3) << name;
  }
}

TEST_P(DiscretisationErrors, RodBentIntoARing) {
  const double known = 2 * std::numbers::pi * std::numbers::pi;
  for (const int edges : {3, 5, 10, 20}) {
    const SolvedLinkage given = found(testing::ring_linkage(edges, GetParam()));
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueLinkageError truth = truth_of(given);
    expect_within_a_factor_of_3(error.max_distance, truth.distance, name);
    LinkageAssembly assembly(given.model);
    const double energy_error = std::abs(assembly.energies(given.state).total() / known - 1);
    if (GetParam() == BendingForm::kTurningAngle) {  // exact for arcs, and known to be
      EXPECT_LT(energy_error, 1e-8);
      EXPECT_LT(error.energy_error, 1e-8);
    } else {
      expect_within_a_factor_of_3(error.energy_error, energy_error, name);
    }
  }
}

TEST_P(DiscretisationErrors, LinkageOpenedOutOfItsPlane) {
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.mean_opening_angle = 1.0;
  conditions.springs = {{ArcPoint{3, 0.4}, {30, 60, 20}, 0.05},
                        {VertexPoint{7, 2}, {60, 60, 0}, 0.05}};
  const LinkageModel drawn = testing::curved_model();
  for (const int edges : {4, 8}) {
    // Places along segments are counted in edges: the same ones in every discretisation.
    Conditions own = conditions;
    const double reach = edges - 1.0;
    own.springs[0].at = ArcPoint{3, (0.5 + 0.3 * reach) / edges};
    own.springs[1].at = VertexPoint{7, edges / 2};
    const SolvedLinkage given =
        found(testing::solved_linkage({drawn.graph(), edges, drawn.stiffness(), GetParam()}, own));
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const TrueLinkageError truth = truth_of(given);
    const std::string name = fmt::format("{} edges", edges);
    expect_within_a_factor_of_3(error.max_distance, truth.distance, name);
    expect_within_a_factor_of_3(error.energy_error, truth.energy, name);
  }
}

INSTANTIATE_TEST_SUITE_P(AllForms, DiscretisationErrors,
                         ::testing::Values(BendingForm::kMaterialFrames,
                                           BendingForm::kAveragedFrames,
                                           BendingForm::kTurningAngle));

/// Of the largest stress, with an estimate of its own: a rod that is bent far carries at its clamp
/// the load times the arm, which is known of the elastica; under its weight alone half of that.
TEST(DiscretisationEstimate, StressesHaveAnErrorOfTheirOwn) {
  const double width = 0.03, height = 0.01, young = 2e9;
  const Section section = Rectangle{width, height};
  const SectionProperties properties = section_properties(section);
  const RodMaterial material{young, 0.3};
  const SectionStiffness stiffness = section_stiffness(properties, material);
  const LinkageStressModel stresses(section, properties, material, StiffAxis::kD1);
  const LineMesh mesh =
      testing::mesh_of({{0, -.05, 0}, {0, 0, 0}, {0, .05, 0}, {1, 0, 0}}, {{1, 3}, {0, 1}, {1, 2}});
  const double heaviness = 0.2;  // N/m: it sinks by 0.005 m
  const double exact = heaviness * 0.5 * height / 2 / (width * std::pow(height, 3) / 12);
  double before = 0;
  for (const int edges : {3, 6, 12, 24}) {
    const LinkageModel model(
        build_linkage_graph(mesh), edges,
        {stiffness.stretching, stiffness.bending_1, stiffness.bending_2, stiffness.torsion});
    Conditions conditions;
    conditions.pins = {{0, Hold::kMotionAndAngle}};
    conditions.gravity = {Eigen::Vector3d(0, 0, -1), heaviness};
    LinkageState state(model);
    ASSERT_TRUE(LinkageEquilibrium(model).solve(state, conditions).converged());
    const DiscretisationError error =
        DiscretisationEstimator(model, stresses).estimate(model, state, conditions);
    ASSERT_TRUE(error.is_known()) << error.message;
    ASSERT_TRUE(error.stress);
    const double truth = std::abs(
        largest_stresses(stresses.evaluate(model, linkage_strains(model, state)))[0] - exact);
    EXPECT_EQ(error.stress->segment, 0);
    EXPECT_GT(error.stress->error, truth / 2) << edges;
    EXPECT_LT(error.stress->error, truth * 2) << edges;
    EXPECT_NEAR(error.stress->share, error.stress->error / exact, 0.1 * error.stress->share);
    if (before > 0) {
      EXPECT_LT(truth, before / 3) << "it falls with the square of the edges";
    }
    before = truth;
  }
}

TEST(DiscretisationEstimate, FollowsChangedSizes) {
  SolvedLinkage given = cantilever(8, 4, BendingForm::kTurningAngle);
  DiscretisationEstimator estimator(given.model);
  const double before = estimator.estimate(given.model, given.state, given.conditions).max_distance;
  given.model.set_section_scales(Eigen::VectorXd::Constant(5, 1.5));
  Eigen::VectorXd lengths = given.model.segment_lengths();
  lengths[0] *= 0.8;
  given.model.set_segment_lengths(lengths);
  LinkageEquilibrium equilibrium(given.model);
  ASSERT_TRUE(equilibrium.solve(given.state, given.conditions).converged());
  const DiscretisationError after = estimator.estimate(given.model, given.state, given.conditions);
  expect_within_a_factor_of_3(after.max_distance, truth_of(given).distance, "stiffer");
  EXPECT_LT(after.max_distance, before / 3);
}

TEST(DiscretisationEstimate, SaysWhereThereIsNone) {
  SolvedLinkage given = cantilever(6, 10, BendingForm::kTurningAngle);
  given.conditions.pins.clear();  // and nothing holds it against its load
  const DiscretisationError error = estimate_of(given);
  EXPECT_FALSE(error.is_known());
  EXPECT_EQ(error.max_distance, 0);
}

TEST(DiscretisationEstimate, IsCancelled) {
  const SolvedLinkage given = cantilever(6, 4, BendingForm::kTurningAngle);
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW((void)DiscretisationEstimator(given.model)
                   .estimate(given.model, given.state, given.conditions, job),
               Error);
}

}  // namespace
}  // namespace limber::rods
