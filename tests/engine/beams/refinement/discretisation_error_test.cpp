#include "engine/beams/refinement/discretisation_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/beams/refinement/member_results.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::BeamEnds;

struct Estimated {
  BeamModel model;
  BeamSolution solution;
  DiscretisationEstimate estimate;
};

Estimated estimated(BeamModel model) {
  Estimated result{std::move(model), {}, {}};
  result.solution = find_equilibrium(BeamStructure(result.model));
  EXPECT_TRUE(result.solution.report.converged()) << result.solution.report.message;
  result.estimate = estimate_discretisation(
      result.model, {Subdivision::even(result.model, 1), result.solution.state});
  EXPECT_TRUE(result.estimate.error.is_known) << result.estimate.error.message;
  return result;
}

struct Difference {
  double distance = 0, energy = 0;
};

/// From sixteen parts an element, of the limit by less than a thousandth of the difference.
Difference from_limit(const Estimated& of) {
  const Subdivision whole = Subdivision::even(of.model, 1), fine = Subdivision::even(of.model, 16);
  BeamModel cut = cut_model(of.model, fine);
  cut.temporary_loads.clear();
  const BeamSolution limit = find_equilibrium_from(
      BeamStructure(cut), carry_state(BeamStructure(of.model), whole, of.solution.state, fine));
  EXPECT_TRUE(limit.report.converged()) << limit.report.message;
  const auto nodes = of.solution.state.positions.cols();
  return {(limit.state.positions.leftCols(nodes) - of.solution.state.positions)
              .colwise()
              .norm()
              .maxCoeff(),
          std::abs(limit.report.elastic_energy - of.solution.report.elastic_energy) /
              limit.report.elastic_energy};
}

void expect_within_a_factor_of_three(double estimate, double truth, const std::string& what) {
  EXPECT_LT(estimate, 3 * truth) << what;
  EXPECT_GT(3 * estimate, truth) << what;
}

BeamModel evenly_loaded(int elements) {
  BeamModel model = limber::testing::straight_beam(elements);
  model.supports.push_back(limber::testing::clamped(0));
  for (int i = 0; i < elements; ++i) model.distributed_loads.push_back({i, {0, 0, -3}});
  return model;
}

TEST(DiscretisationError, IsWithinAFactorOfThreeOfKnownAnswers) {
  struct Case {
    const char* name;
    BeamModel (*make)(int elements);
  };
  const Case cases[] = {
      {"cantilever, alpha 1", [](int n) { return limber::testing::cantilever_model(n, 1); }},
      {"cantilever, alpha 10", [](int n) { return limber::testing::cantilever_model(n, 10); }},
      {"evenly loaded", evenly_loaded},
      {"elastica, hinged",
       [](int n) { return limber::testing::compressed_model(n, BeamEnds::kHinged, 0.3); }},
      {"elastica, clamped",
       [](int n) { return limber::testing::compressed_model(n, BeamEnds::kClamped, 0.3); }},
      {"roll-up to a circle", limber::testing::roll_up_model},
      {"45 degree bend", [](int n) { return limber::testing::bend_model(n, 600, 1.0 / 6); }},
  };
  for (const Case& known : cases) {
    for (const int elements : {6, 10}) {
      const Estimated of = estimated(known.make(elements));
      const Difference truth = from_limit(of);
      const std::string what = std::string(known.name) + ", " + std::to_string(elements);
      const DiscretisationError& error = of.estimate.error;
      expect_within_a_factor_of_three(error.max_distance, truth.distance, what);
      expect_within_a_factor_of_three(error.energy_error, truth.energy, what + ", energy");
      EXPECT_EQ(error.elements, elements);
      EXPECT_GE(error.compared_elements, 2 * elements);
    }
  }
}

TEST(DiscretisationError, IsThatOfAClosedForm) {
  for (const int elements : {6, 12, 24}) {
    const Estimated of = estimated(limber::testing::roll_up_model(elements));
    double off = 0;  // from the circle
    for (int i = 0; i <= elements; ++i) {
      const double turned = 2 * std::numbers::pi * i / elements;
      const Eigen::Vector3d on_circle(std::sin(turned), 0, 1 - std::cos(turned));
      off = std::max(
          off, (of.solution.state.positions.col(i) - on_circle / (2 * std::numbers::pi)).norm());
    }
    expect_within_a_factor_of_three(of.estimate.error.max_distance, off, std::to_string(elements));
    EXPECT_DOUBLE_EQ(of.estimate.error.position_error, of.estimate.error.max_distance);
  }
  // A buckled column: the elastica's largest deflection.
  for (const int elements : {4, 8}) {
    const limber::testing::Column column{limber::testing::ColumnEnds::kClampedFree, elements, 1.5};
    BeamModel model = limber::testing::column_model(column);
    model.temporary_loads.push_back({elements, {1, 0.1, 0}});
    const Estimated of = estimated(std::move(model));
    const double off = std::abs(limber::testing::deflection(column, of.solution.state) -
                                limber::testing::elastica_deflection(column));
    // A component of the distance, and axial stiffness, which an elastica has none of.
    EXPECT_GT(3 * of.estimate.error.max_distance, off) << elements;
  }
}

TEST(DiscretisationError, FindsTheOrderWhereNodesMoveFar) {
  const Estimated bend = estimated(limber::testing::bend_model(4, 600, 1.0 / 6));
  EXPECT_GT(bend.estimate.error.position_error, kSmallDiscretisationError);
  EXPECT_NEAR(bend.estimate.error.order, 2, 0.3);
  EXPECT_EQ(bend.estimate.error.compared_elements, 16);
  const Estimated circle = estimated(limber::testing::roll_up_model(5));
  EXPECT_NEAR(circle.estimate.error.order, 4, 0.5);
}

/// A load over an element is exact but for its bend: the error comes from those that bend most.
TEST(DiscretisationError, IndicatorsAreLargestWhereElementsBendMost) {
  BeamModel model = limber::testing::straight_beam(8);
  model.supports.push_back(limber::testing::clamped(0));
  model.distributed_loads.push_back({2, {0, 0, -20}});
  const Estimated of = estimated(std::move(model));
  const std::vector<double>& indicators = of.estimate.indicators;
  ASSERT_EQ(indicators.size(), 8U);
  EXPECT_GT(indicators[0], indicators[1]);
  EXPECT_GT(indicators[1], 2 * indicators[2]);
  for (std::size_t e = 3; e < 8; ++e) EXPECT_GT(indicators[2], 10 * indicators[e]) << e;
}

TEST(DiscretisationError, SaysWhyItIsNotKnown) {
  const BeamModel model = limber::testing::cantilever_model(8, 1);
  const BeamSolution solution = find_equilibrium(BeamStructure(model));
  const CutEquilibrium cut{Subdivision::even(model, 1), solution.state};
  const DiscretisationEstimate limited = estimate_discretisation(model, cut, 15);
  EXPECT_FALSE(limited.error.is_known);
  EXPECT_EQ(limited.error.message, "halves of 8 elements exceed the limit of 15");
  EXPECT_TRUE(estimate_discretisation(model, cut, 16).error.is_known);
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW((void)estimate_discretisation(model, cut, kMaxCutElements, job), Error);
}

TEST(DiscretisationError, CoversMomentsAndUtilisationWherePositionsAreRight) {
  // Positions of the ends are fixed, whatever the elements are: tension within the span reduces
  // the moments of the clamps, which one element does not see.
  BeamModel model = limber::testing::straight_beam(1);
  model.sections[0] = {1e4, 1, 1, 1};
  model.sections[0].young = 1e6;
  model.sections[0].fibre_2 = model.sections[0].fibre_3 = 0.01;
  model.sections[0].yield_stress = 1e5;
  model.supports = {limber::testing::clamped(0), limber::testing::clamped(1)};
  model.elements[0].rest_length = 0.98;  // a tension of 200 EI / L^2
  model.distributed_loads.push_back({0, {0, 0, -1}});
  const Subdivision whole = Subdivision::even(model, 1), fine = Subdivision::even(model, 32);
  const BeamStructure structure(model);
  const BeamState state = structure.rest_state();
  const DiscretisationError error = estimate_discretisation(model, {whole, state}).error;
  ASSERT_TRUE(error.is_known) << error.message;
  EXPECT_EQ(error.position_error, 0);
  const BeamSolution limit = find_equilibrium_from(BeamStructure(cut_model(model, fine)),
                                                   carry_state(structure, whole, state, fine));
  ASSERT_TRUE(limit.report.converged()) << limit.report.message;
  const BeamResults coarse = results_of(structure, state);
  const BeamResults finest =
      member_results(results_of(BeamStructure(cut_model(model, fine)), limit.state), fine);
  // w L^2 / 12 (6 / u) (coth(u / 2) - 2 / u) at the clamps, u^2 = N L^2 / EI.
  EXPECT_GT(std::abs(coarse.forces[0].start_moment_2),
            1.2 * std::abs(finest.forces[0].start_moment_2));
  double off = 0, largest = 0;
  for (int i = 0; i <= 64; ++i) {
    const double place = i / 64.0, limit_moment = finest.distributions.at(0, place).moment_2;
    off = std::max(off, std::abs(coarse.distributions.at(0, place).moment_2 - limit_moment));
    largest = std::max(largest, std::abs(coarse.distributions.at(0, place).moment_2));
  }
  expect_within_a_factor_of_three(error.max_moment_error, off, "moment");
  EXPECT_GT(error.moment_error, 0.01);
  EXPECT_EQ(error.worst_moment_element, 0);
  ASSERT_TRUE(error.utilisation_error.has_value());
  expect_within_a_factor_of_three(
      *error.utilisation_error,
      std::abs(coarse.largest_utilisation - finest.largest_utilisation) /
          std::max(coarse.largest_utilisation, finest.largest_utilisation),
      "utilisation");
}

TEST(DiscretisationError, OfLinearBeamsUnderSpreadLoadsIsNone) {
  BeamModel model = limber::testing::straight_beam(1);
  model.supports = {limber::testing::clamped(0), {1, {false, true, true, false, false, false}}};
  model.distributed_loads.push_back({0, {0, 0, -1e-3}});
  const Estimated of = estimated(std::move(model));
  EXPECT_LT(of.estimate.error.moment_error, 1e-4);
  EXPECT_FALSE(of.estimate.error.utilisation_error.has_value());
}

/// Two cables of 10.5 m over 20 m.
TEST(DiscretisationError, OfCablesThatWereNeverCutIsUnknown) {
  BeamModel model;
  model.nodes = {
      {Eigen::Vector3d(0, 0, 0)}, {Eigen::Vector3d(10, 0, 0)}, {Eigen::Vector3d(20, 0, 0)}};
  model.sections = {make_section(circle(0.01), {160e9, 0.3, 7850, 0})};
  for (const int start : {0, 1}) {
    BeamElement cable;
    cable.start = start;
    cable.finish = start + 1;
    cable.kind = BeamKind::kCable;
    cable.rest_length = 10.5;
    model.elements.push_back(cable);
  }
  for (const int node : {0, 2})
    model.supports.push_back({node, {true, true, true, false, false, false}});
  model.gravity = {0, 0, -9.81};
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  const CutEquilibrium cut{Subdivision::even(model, 1), found.state};
  const DiscretisationError error = estimate_discretisation(model, cut).error;
  EXPECT_FALSE(error.is_known);
  EXPECT_NE(error.message.find("element 0 is a cable that sags"), std::string::npos)
      << error.message;
  // Without a load over it a cable is straight.
  model.gravity.setZero();
  model.loads.push_back({1, {0, 0, -100}});
  const BeamSolution hung = find_equilibrium(BeamStructure(model));
  ASSERT_TRUE(hung.report.converged()) << hung.report.message;
  const DiscretisationError straight =
      estimate_discretisation(model, {cut.subdivision, hung.state}).error;
  EXPECT_TRUE(straight.is_known) << straight.message;
  EXPECT_LT(straight.position_error, 1e-9);
}

}  // namespace
}  // namespace limber::beams
