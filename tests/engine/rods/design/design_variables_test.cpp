// Designs by lengths of segments, by lengths of edges and by sections.
#include "engine/rods/design/design_variables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/design/compare_designs.h"
#include "engine/rods/design/design_optimizer.h"
#include "tests/engine/rods/design/small_designs.h"

namespace limber::rods {
namespace {

using Lengths = LengthVariables;
using Sections = SectionVariables;
using testing::curved_design;
using testing::random_direction;
using testing::SmallDesign;

std::string field_of(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.field();
  }
  return "none";
}

using Numbers = DesignMeasures<double>;
using Vectors = DesignMeasures<Eigen::VectorXd>;
struct Measure {
  const char* name;
  double Numbers::*number;
  Eigen::VectorXd Vectors::*vector;
};
constexpr Measure kMeasures[] = {
    {"objective", &Numbers::objective, &Vectors::objective},
    {"flatness", &Numbers::flatness, &Vectors::flatness},
    {"smallest angle", &Numbers::smallest_angle, &Vectors::smallest_angle},
    {"flat energy", &Numbers::flat_energy, &Vectors::flat_energy}};

/// Of one direction: relative differences from fourth-order differences of trials.
struct Mismatch {
  double gradient[4], product[4];
};
std::optional<Mismatch> mismatch(LinkageDesign& design, const Eigen::VectorXd& v, double step) {
  const Eigen::VectorXd home = design.parameters();
  const DesignPoint here = design.point();
  const Vectors gradients = design.gradients(), products = design.products(v);
  std::vector<DesignPoint> points;
  for (const double side : {2.0, 1.0, -1.0, -2.0}) {
    DesignTrial trial = design.trial(home + side * step * v);
    if (trial.status != TrialStatus::kFound) return {};
    points.push_back(std::move(trial.point));
  }
  std::vector<Numbers> values;
  std::vector<Vectors> beside;
  for (const DesignPoint& point : points) {
    values.push_back(design.values(point));
    design.move_to(point);
    beside.push_back(design.gradients());
  }
  design.move_to(here);
  Mismatch result{};
  for (std::size_t m = 0; m < std::size(kMeasures); ++m) {
    const auto [name, number, vector] = kMeasures[m];
    const double slope =
        (8 * (values[1].*number - values[2].*number) - (values[0].*number - values[3].*number)) /
        (12 * step);
    const Eigen::VectorXd bent =
        (8 * (beside[1].*vector - beside[2].*vector) - (beside[0].*vector - beside[3].*vector)) /
        (12 * step);
    result.gradient[m] = std::abs((gradients.*vector).dot(v) - slope) / (gradients.*vector).norm();
    result.product[m] = (products.*vector - bent).norm() / (products.*vector).norm();
  }
  return result;
}

/// Steps are refined until differences are good enough: linkages that are about to buckle bend
/// within small ones.
void expect_derivatives(LinkageDesign& design) {
  const Eigen::VectorXd v = random_direction(design.parameters().size(), 3);
  Mismatch best;
  std::fill_n(best.gradient, 4, 1);
  std::fill_n(best.product, 4, 1);
  for (const double step : {2e-3, 5e-4, 1e-4, 2e-5}) {
    const auto here = mismatch(design, v, step);
    if (!here) continue;
    for (std::size_t m = 0; m < std::size(kMeasures); ++m) {
      best.gradient[m] = std::min(best.gradient[m], here->gradient[m]);
      best.product[m] = std::min(best.product[m], here->product[m]);
    }
  }
  for (std::size_t m = 0; m < std::size(kMeasures); ++m) {
    EXPECT_LT(best.gradient[m], 1e-6) << kMeasures[m].name;
    EXPECT_LT(best.product[m], 2e-4) << kMeasures[m].name;
  }
}

class DesignVariablesTest : public ::testing::TestWithParam<DesignVariables> {};

TEST_P(DesignVariablesTest, DerivativesAgreeWithDifferencesOfTrials) {
  LinkageDesign design = curved_design().design(GetParam());
  // Away from the start, where edges are alike and sections 1.
  testing::lead(design, testing::varied(design.parameters(), 0.002, 8), 1);
  expect_derivatives(design);
}

TEST_P(DesignVariablesTest, DerivativesOfBurdAgreeWithDifferencesOfTrials) {
  const auto file = testing::linkage_file("burd_flat_opt_scaled");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no data";
  const LinkageModel model(build_linkage_graph(scene::read_line_mesh_file(file)), 10,
                           RodStiffness{6750, 5062.5, 316.40625, 386.3121963558732});
  Conditions flat;
  flat.pins = {{20}};
  SmallDesign problem(model, flat, 91 * kDegree);
  problem.criteria.targets = {{0, {10, -5, 20}, 0.5}, {30, {130, 100, -10}, 2}};
  problem.criteria.angle_sharpness = 30;
  problem.criteria.plane = Plane{{0, 0, 1}, {0.1, 0.2, 1}};
  LinkageDesign design = problem.design(GetParam());
  expect_derivatives(design);
}

TEST_P(DesignVariablesTest, PredictionsAreOfSecondOrder) {
  LinkageDesign design = curved_design().design(GetParam());
  const Eigen::VectorXd home = design.parameters();
  const Eigen::VectorXd v = random_direction(home.size(), 6);
  // Scales are a share of 1, lengths of 40.
  const double unit = GetParam().sections == Sections::kKept ? 0.125 : 0.03;
  const auto surprise = [&](double h) {
    const DesignTrial trial = design.trial(home + h * v);
    EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
    return trial.surprise;
  };
  EXPECT_NEAR(surprise(unit) / surprise(unit / 2), 8, 2);
}

TEST_P(DesignVariablesTest, TheSearchGainsAndStaysWithinBounds) {
  SmallDesign problem = curved_design();
  problem.criteria.distance_weight = 1e3;
  LinkageDesign design = problem.design(GetParam());
  const Eigen::VectorXd start = design.parameters();
  DesignOptimizerOptions options;
  options.shortest = options.thinnest = 0.98;
  options.longest = options.thickest = 1.02;
  options.flat_height = 0.2;
  options.max_iterations = 25;
  const DesignReport report = optimize_design(design, options);
  EXPECT_LT(report.after.objective, report.before.objective) << report.message;
  EXPECT_GE((design.parameters().array() / start.array()).minCoeff(), 0.98 - 1e-12);
  EXPECT_LE((design.parameters().array() / start.array()).maxCoeff(), 1.02 + 1e-12);
  for (const int i : report.at_bound) {
    const double share = design.parameters()[i] / start[i];
    EXPECT_NEAR(std::abs(share - 1), 0.02, 1e-12) << i;
  }
  // The point says all of it: a design that begins there is the same.
  const LinkageDesign again(problem.model, problem.flat, problem.deployed, design.point(),
                            design.criteria(), problem.limits, GetParam());
  EXPECT_LT((again.parameters() - design.parameters()).norm(), 1e-12 * start.norm());
}

TEST_P(DesignVariablesTest, FindsATargetThatIsKnownToBeReachable) {
  SmallDesign problem = curved_design();
  problem.criteria = {};
  {
    LinkageDesign known = problem.design(GetParam());
    testing::lead(known, testing::varied(known.parameters(), 0.03, 17), 20);
    for (int j = 0; j < problem.model.variables().joints(); ++j) {
      const auto& joint = known.point().deployed.joints()[static_cast<std::size_t>(j)];
      problem.criteria.targets.push_back({j, joint.position, 1});
    }
  }
  problem.criteria.distance_weight = 1e8;
  LinkageDesign design = problem.design(GetParam());
  DesignOptimizerOptions options;
  options.flat_height = 0.2;
  const DesignReport report = optimize_design(design, options);
  // Sections alone hardly move joints: the target is hundredths of a millimetre away, and energies
  // weigh as much as that.
  const double factor = GetParam().lengths == Lengths::kKept ? 5 : 50;
  EXPECT_LT(std::sqrt(report.after.distance), std::sqrt(report.before.distance) / factor)
      << report.message;
  EXPECT_LE(report.flat_height, options.flat_height * 1.001);
}

INSTANTIATE_TEST_SUITE_P(Kinds, DesignVariablesTest,
                         ::testing::Values(DesignVariables{Lengths::kSegments, Sections::kKept},
                                           DesignVariables{Lengths::kEdges, Sections::kKept},
                                           DesignVariables{Lengths::kKept, Sections::kSegments},
                                           DesignVariables{Lengths::kSegments, Sections::kSegments},
                                           DesignVariables{Lengths::kEdges, Sections::kSegments}));

TEST(DesignVariables, WithoutTargetsSectionsGoToTheThinnest) {
  SmallDesign problem = curved_design();
  problem.criteria = {};
  LinkageDesign design = problem.design({Lengths::kKept, Sections::kSegments});
  DesignOptimizerOptions options;
  options.thinnest = 0.9;
  options.flat_height = 0.5;
  (void)optimize_design(design, options);
  EXPECT_NEAR(design.point().sections.maxCoeff(), 0.9, 1e-3);
  EXPECT_EQ(design.point().lengths, problem.start->lengths);
}

TEST(DesignVariables, OneScaleForAllSectionsIsAnotherEnergyAndTheSameShapeIfRodsOnlyBend) {
  // All stiffnesses but that of stretching times s^4: rods of this linkage hardly stretch.
  const SmallDesign problem = curved_design();
  LinkageDesign design = problem.design({Lengths::kKept, Sections::kSegments});
  const double before = design.values(design.point()).deployed_energy;
  const DesignTrial trial =
      design.trial(Eigen::VectorXd::Constant(design.parameters().size(), 1.05));
  ASSERT_EQ(trial.status, TrialStatus::kFound) << trial.message;
  const double after = design.values(trial.point).deployed_energy;
  EXPECT_NEAR(after / before, std::pow(1.05, 4), 0.02);
  EXPECT_LT(testing::joint_distance(trial.point.deployed, problem.start->deployed), 1);
}

TEST(DesignVariables, BadInputIsNamed) {
  const SmallDesign problem = curved_design();
  const auto with = [&](const auto& spoil, DesignVariables variables) {
    SmallDesign spoilt = problem;
    spoil(*spoilt.start);
    return field_of([&] { (void)spoilt.design(variables); });
  };
  const Eigen::VectorXd edges = problem.model.edge_lengths();
  EXPECT_EQ(with([](DesignPoint&) {}, {Lengths::kKept, Sections::kKept}), "lengths");
  EXPECT_EQ(with([&](DesignPoint& p) { p.edges = edges; }, {}), "start.edges");
  EXPECT_EQ(
      with([&](DesignPoint& p) { p.edges = edges.head(3); }, {Lengths::kEdges, Sections::kKept}),
      "start.edges");
  EXPECT_EQ(with([&](DesignPoint& p) { p.edges = -edges; }, {Lengths::kEdges, Sections::kKept}),
            "start.edges[0]");
  EXPECT_EQ(with([](DesignPoint& p) { p.sections = Eigen::VectorXd::Ones(2); }, {}),
            "start.sections");
  EXPECT_EQ(with([](DesignPoint& p) { p.lengths.conservativeResize(3); }, {}), "start.lengths");
  const auto search = [&](const auto& spoil) {
    LinkageDesign design = problem.design({Lengths::kEdges, Sections::kSegments});
    DesignOptimizerOptions options;
    spoil(options);
    return field_of([&] { (void)optimize_design(design, options); });
  };
  const Eigen::VectorXd sections = problem.model.section_scales();
  EXPECT_EQ(search([](DesignOptimizerOptions& o) { o.thinnest = 1; }), "thinnest");
  EXPECT_EQ(search([](DesignOptimizerOptions& o) { o.thickest = 1; }), "thickest");
  EXPECT_EQ(search([&](DesignOptimizerOptions& o) { o.thinnest_sections = 1.1 * sections; }),
            "thinnest_sections[0]");
  EXPECT_EQ(search([&](DesignOptimizerOptions& o) { o.thickest_sections = sections.head(2); }),
            "thickest_sections");
  EXPECT_EQ(search([&](DesignOptimizerOptions& o) { o.shortest_lengths = 1.1 * edges; }),
            "shortest_lengths[0]");
}

TEST(DesignVariables, DesignsDifferBySectionsToo) {
  const SmallDesign problem = curved_design();
  DesignPoint thicker = *problem.start;
  thicker.sections = Eigen::VectorXd::Constant(thicker.lengths.size(), 1.1);
  EXPECT_NEAR(compare_designs(*problem.start, thicker).lengths, 0.1, 1e-12);
  EXPECT_EQ(compare_designs(*problem.start, *problem.start).lengths, 0);
}

}  // namespace
}  // namespace limber::rods
