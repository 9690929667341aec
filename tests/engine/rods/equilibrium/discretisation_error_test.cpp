// Estimates of the discretisation error against known answers and against much finer edges.

#include "engine/rods/equilibrium/discretisation_error.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_assembly.h"
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
