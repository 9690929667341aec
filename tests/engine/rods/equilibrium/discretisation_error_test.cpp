// Estimates of the discretisation error against known answers and against much finer edges.

#include "engine/rods/equilibrium/discretisation_error.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::mesh_of;

/// An equilibrium of a linkage, and what it is held by.
struct Solved {
  LinkageModel model;
  LinkageState state;
  Conditions conditions;
};

Solved solved(LinkageModel model, const Conditions& conditions) {
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  return {std::move(model), std::move(state), conditions};
}

/// Soft in the plane of the joints alone; without stretching that shows.
constexpr RodStiffness kPlanar{1e6, 1, 100, 100};

/// A rod along x from a joint that holds it, where another one crosses, to a joint at x = 1, where
/// the end of a third one hangs.
LinkageGraph cantilever_graph() {
  return build_linkage_graph(
      mesh_of({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {1, 1, 0}},
              {{0, 1}, {2, 0}, {0, 3}, {4, 0}, {1, 5}}));
}

Solved cantilever(int edges, double alpha, BendingForm form) {
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kAngle}};
  conditions.loads = {{1, {0, alpha, 0}, {0, 0, 0}, 0}};
  return solved({cantilever_graph(), edges, kPlanar, form}, conditions);
}

/// A rod that passes corners of a regular hexagon of perimeter 1, where the ends of others hang.
Solved ring(int edges, BendingForm form) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2i> lines;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d out(std::cos(i * std::numbers::pi / 3),
                              std::sin(i * std::numbers::pi / 3), 0);
    points.push_back(out / 6);
    lines.emplace_back(i, (i + 1) % 6);
  }
  for (int i = 0; i < 6; ++i) {
    points.push_back(points[static_cast<std::size_t>(i)] * 0.7);
    lines.emplace_back(i, 6 + i);
  }
  Conditions conditions;
  for (int j = 0; j < 6; ++j) conditions.pins.push_back({j, Hold::kAngle});
  return solved({build_linkage_graph(mesh_of(points, lines)), edges, kPlanar, form}, conditions);
}

/// A rod of length 1 between two joints that hold it, brought to 0.3 of that; others cross there.
Solved elastica(int edges, BendingForm form) {
  const LineMesh mesh = mesh_of(
      {{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, -1, 0}, {1, 1, 0}, {1, -1, 0}},
      {{0, 1}, {2, 0}, {1, 3}, {0, 4}, {5, 0}, {1, 6}, {7, 1}});
  Solved given{{build_linkage_graph(mesh), edges, kPlanar, form},
               LinkageState(LinkageModel(build_linkage_graph(mesh), edges, kPlanar, form)),
               {}};
  LinkageEquilibrium equilibrium(given.model);
  given.conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kMotionAndAngle}};
  for (const double span : {0.95, 0.8, 0.6, 0.45, 0.3}) {
    given.conditions.pins[1].position = Eigen::Vector3d(span, 0, 0);
    const EquilibriumReport report = equilibrium.solve(given.state, given.conditions);
    EXPECT_TRUE(report.converged()) << report.message;
  }
  return given;
}
double height_of(const Solved& given) {
  double height = 0;
  for (int i = 0; i <= given.model.variables().edges(0); ++i)
    height = std::max(height, std::abs(given.state.vertex(given.model, 0, i).y()));
  return height;
}

struct TrueError {
  double distance = 0, energy = 0;
};
/// Against edges an eighth as long.
TrueError true_error(const Solved& given) {
  constexpr int kLevels = 3;
  std::vector<HalvedLinkage> levels;
  std::vector<LinkageState> states;
  Conditions conditions = given.conditions;
  for (int k = 0; k < kLevels; ++k) {
    const LinkageModel& model = k == 0 ? given.model : levels.back().model();
    HalvedLinkage halved(model);
    LinkageState state = halved.prolonged(model, k == 0 ? given.state : states.back());
    LinkageEquilibrium equilibrium(halved.model());
    for (TargetSpring& spring : conditions.springs) {
      const auto* const vertex = std::get_if<VertexPoint>(&spring.at);
      const int s = vertex ? vertex->segment : std::get<ArcPoint>(spring.at).segment;
      const double place = vertex
                               ? vertex->vertex
                               : std::get<ArcPoint>(spring.at).share * model.variables().edges(s);
      spring.at = ArcPoint{s, halved.halved_place(s, place) / halved.model().variables().edges(s)};
    }
    const EquilibriumReport report = equilibrium.solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    levels.push_back(std::move(halved));
    states.push_back(std::move(state));
  }
  const LinkageModel& fine = levels.back().model();
  const LinkageState& state = states.back();
  const auto point = [&](int segment, double place) -> Eigen::Vector3d {
    for (const HalvedLinkage& level : levels) place = level.halved_place(segment, place);
    const int edge = std::min(static_cast<int>(place), fine.variables().edges(segment) - 1);
    return (edge + 1 - place) * state.vertex(fine, segment, edge) +
           (place - edge) * state.vertex(fine, segment, edge + 1);
  };
  TrueError error;
  error.distance = testing::joint_distance(given.state, state);
  for (int s = 0; s < fine.variables().segments(); ++s) {
    for (int i = 1; i < given.model.variables().edges(s); ++i) {
      error.distance =
          std::max(error.distance, (given.state.vertex(given.model, s, i) - point(s, i)).norm());
    }
  }
  LinkageAssembly here(given.model), there(fine);
  const double limit = there.energies(state).total();
  error.energy = std::abs(here.energies(given.state).total() / limit - 1);
  return error;
}

DiscretisationError estimate_of(const Solved& given) {
  return DiscretisationEstimator(given.model).estimate(given.model, given.state, given.conditions);
}

void expect_within_a_factor_of_3(double estimate, double truth, const std::string& what) {
  EXPECT_GT(estimate, truth / 3) << what;
  EXPECT_LT(estimate, truth * 3) << what;
}

class DiscretisationErrors : public ::testing::TestWithParam<BendingForm> {};

TEST_P(DiscretisationErrors, CantileverUnderATipLoad) {
  const Eigen::Vector3d tip(1 - 0.55500, 0.81061, 0);  // alpha = 10
  for (const int edges : {3, 5, 10, 20, 40}) {
    const Solved given = cantilever(edges, 10, GetParam());
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueError truth = true_error(given);
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
    const Solved given = elastica(edges, GetParam());
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueError truth = true_error(given);
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
    const Solved given = ring(edges, GetParam());
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const std::string name = fmt::format("{} edges", edges);
    const TrueError truth = true_error(given);
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
    const Solved given = solved({drawn.graph(), edges, drawn.stiffness(), GetParam()}, own);
    const DiscretisationError error = estimate_of(given);
    ASSERT_TRUE(error.is_known()) << error.message;
    const TrueError truth = true_error(given);
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
  Solved given = cantilever(8, 4, BendingForm::kTurningAngle);
  DiscretisationEstimator estimator(given.model);
  const double before = estimator.estimate(given.model, given.state, given.conditions).max_distance;
  given.model.set_section_scales(Eigen::VectorXd::Constant(5, 1.5));
  Eigen::VectorXd lengths = given.model.segment_lengths();
  lengths[0] *= 0.8;
  given.model.set_segment_lengths(lengths);
  LinkageEquilibrium equilibrium(given.model);
  ASSERT_TRUE(equilibrium.solve(given.state, given.conditions).converged());
  const DiscretisationError after = estimator.estimate(given.model, given.state, given.conditions);
  expect_within_a_factor_of_3(after.max_distance, true_error(given).distance, "stiffer");
  EXPECT_LT(after.max_distance, before / 3);
}

TEST(DiscretisationEstimate, SaysWhereThereIsNone) {
  Solved given = cantilever(6, 10, BendingForm::kTurningAngle);
  given.conditions.pins.clear();  // and nothing holds it against its load
  const DiscretisationError error = estimate_of(given);
  EXPECT_FALSE(error.is_known());
  EXPECT_EQ(error.max_distance, 0);
}

TEST(DiscretisationEstimate, IsCancelled) {
  const Solved given = cantilever(6, 4, BendingForm::kTurningAngle);
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW((void)DiscretisationEstimator(given.model)
                   .estimate(given.model, given.state, given.conditions, job),
               Error);
}

}  // namespace
}  // namespace limber::rods
