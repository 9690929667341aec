// Straight columns beyond their buckling loads are balanced and no minima.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>

#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::Beside;
using limber::testing::Column;
using limber::testing::column_model;
using limber::testing::ColumnEnds;
using limber::testing::negative_by_differences;
using limber::testing::straight_state;

constexpr ColumnEnds kAllEnds[] = {ColumnEnds::kPinnedPinned, ColumnEnds::kClampedFree,
                                   ColumnEnds::kClampedPinned, ColumnEnds::kClampedGuided,
                                   ColumnEnds::kClampedClamped};
constexpr Beside kBeside[] = {Beside::kNothing, Beside::kSoftCantilever};

std::string text(const Column& column) {
  return std::string(limber::testing::to_string(column.ends)) + ", " +
         std::to_string(column.elements) + " elements, " + std::to_string(column.load) +
         " times Euler's load" +
         (column.beside == Beside::kNothing ? "" : ", beside a soft cantilever");
}

/// Not turned over: hanging from its other end it may be straight and stable.
bool is_straight_and_pressed(const Column& column, const BeamState& state) {
  return limber::testing::deflection(column, state) < 1e-6 &&
         state.positions(2, column.elements) > 0;
}

using Solve = BeamSolution (*)(const BeamStructure&);

BeamSolution by_newton(const BeamStructure& structure) {
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  return find_equilibrium(structure, options);
}
BeamSolution by_relaxation_then_newton(const BeamStructure& structure) {
  BeamSolveOptions options;
  options.method = BeamMethod::kRelaxationThenNewton;
  return find_equilibrium(structure, options);
}
BeamSolution by_relaxation(const BeamStructure& structure) {
  BeamSolveOptions options;
  options.method = BeamMethod::kRelaxation;
  return find_equilibrium(structure, options);
}
BeamSolution chosen(const BeamStructure& structure) { return find_equilibrium(structure); }
/// As sessions do: loads come on where there were none.
BeamSolution followed(const BeamStructure& structure) {
  return follow_equilibrium(structure, structure.rest_state(), {}, BeamSolveOptions::following());
}

/// Asked for more than once.
int negative_when_straight(const Column& column, const BeamStructure& structure) {
  static std::map<std::tuple<ColumnEnds, int, double, Beside>, int> known;
  const auto [place, is_new] =
      known.try_emplace({column.ends, column.elements, column.load, column.beside}, 0);
  if (is_new) place->second = negative_by_differences(structure, straight_state(column));
  return place->second;
}

/// What the straight column is follows from the second derivatives of its own energy, not from
/// Euler: with two elements a clamped-pinned column is stable at 1.02 times his load.
void expect_honest(const Column& column, Solve solve) {
  SCOPED_TRACE(text(column));
  const BeamStructure structure(column_model(column));
  const int unstable = negative_when_straight(column, structure);
  const BeamSolution found = solve(structure);
  const BeamReport& report = found.report;
  if (!report.unjudged_elements.empty()) {
    // Its elements are too long to show how it buckles: that is said beyond Euler's load only.
    EXPECT_GT(column.load, 1) << report.message;
    EXPECT_FALSE(report.negative_eigenvalues.has_value());
  } else if (unstable == 0) {
    EXPECT_TRUE(report.converged()) << report.message;
    EXPECT_TRUE(is_straight_and_pressed(column, found.state));
    EXPECT_EQ(report.negative_eigenvalues, 0);
  } else if (is_straight_and_pressed(column, found.state) && report.negative_eigenvalues) {
    EXPECT_EQ(report.status, BeamStatus::kUnstable) << report.message;
    EXPECT_EQ(report.negative_eigenvalues, unstable);
    EXPECT_NE(report.message.find("balanced but unstable"), std::string::npos) << report.message;
  } else if (report.converged()) {
    EXPECT_FALSE(is_straight_and_pressed(column, found.state));
    EXPECT_EQ(negative_by_differences(structure, found.state), 0) << "it is no minimum";
    EXPECT_EQ(report.negative_eigenvalues, 0);
  } else {
    EXPECT_NE(report.message.find("the structure as drawn buckles at"), std::string::npos)
        << report.message;
  }
}

/// Of the most compressed element, in EI / L^2. A cantilever of its length buckles at 2.5; up to 2
/// the discrete structure has the equilibria of the column.
double compression_of(const Column& column) {
  const double bending = limber::testing::euler_load(ColumnEnds::kPinnedPinned) /
                         (std::numbers::pi * std::numbers::pi);
  return column.load * limber::testing::euler_load(column.ends) / bending /
         (column.elements * column.elements);
}
constexpr double kMaxCompressionOfFloor = 2;

/// @returns whether the column is one of those
bool expect_buckled_minimum(const Column& column, Solve solve) {
  if (compression_of(column) > kMaxCompressionOfFloor) return false;
  SCOPED_TRACE(text(column));
  const BeamStructure structure(column_model(column));
  if (negative_when_straight(column, structure) == 0) return false;
  const BeamSolution found = solve(structure);
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_FALSE(is_straight_and_pressed(column, found.state));
  EXPECT_EQ(negative_by_differences(structure, found.state), 0);
  return true;
}

class BeamBuckling : public ::testing::TestWithParam<Solve> {};

TEST_P(BeamBuckling, NoStraightColumnBeyondItsLoadIsAMinimum) {
  for (const Beside beside : kBeside) {
    for (const ColumnEnds ends : kAllEnds) {
      for (const int elements : {2, 4, 8, 16, 32}) {
        for (const double load : {0.9, 1.02, 1.5, 3.0, 30.0}) {
          // Short steps and relaxations beyond the load take long: one length of elements there.
          if (GetParam() == by_newton || load < 1 || elements == 8)
            expect_honest({ends, elements, load, beside}, GetParam());
        }
      }
    }
  }
}

/// Columns whose pinned end comes down turn over and hang. With many elements, or beside a body
/// that the step moves as well, a single load step so far converges or not by the last digits of
/// the linear algebra: only short steps have to.
bool turns_over_in_one_step(const Column& column, Solve solve) {
  const bool in_one_step = solve == by_newton || solve == by_relaxation_then_newton;
  const bool is_sensitive = column.elements > (column.beside == Beside::kNothing ? 8 : 2);
  return in_one_step && is_sensitive && column.load > 1.02 &&
         (column.ends == ColumnEnds::kPinnedPinned || column.ends == ColumnEnds::kClampedPinned);
}

/// Methods that follow the branch in short steps take longer: each of them gets some of the loads.
TEST_P(BeamBuckling, ResolvedColumnsBeyondTheirLoadsConvergeBuckled) {
  const Solve solve = GetParam();
  int cases = 0;
  for (const double load : {1.02, 1.5, 3.0, 30.0}) {
    if ((solve == chosen && load < 3) || (solve == followed && load != 1.5)) continue;
    for (const Beside beside : kBeside) {
      if (beside != Beside::kNothing && solve != by_newton && solve != chosen) continue;
      for (const ColumnEnds ends : kAllEnds) {
        for (const int elements : {2, 4, 8, 16, 32}) {
          const Column column{ends, elements, load, beside};
          if (turns_over_in_one_step(column, solve)) continue;
          cases += expect_buckled_minimum(column, solve) ? 1 : 0;
        }
      }
    }
  }
  const std::map<Solve, int> least{
      {by_newton, 100}, {chosen, 40}, {by_relaxation_then_newton, 55}, {followed, 20}};
  EXPECT_GE(cases, least.at(solve));
}

/// Elements so long that no equilibrium of the column exists: the message says which.
TEST(BeamBucklingMessages, TheMessageOnAColumnOfTooFewElementsStatesHowManyItTakes) {
  const Column column{ColumnEnds::kClampedGuided, 2, 30};
  for (const Solve solve : {by_newton, chosen, by_relaxation_then_newton, followed}) {
    const BeamReport report = solve(BeamStructure(column_model(column))).report;
    EXPECT_FALSE(report.converged());
    const std::string expected =
        "the structure as drawn buckles at 3.3";  // 1 / 30, a little late for two elements
    EXPECT_NE(report.message.find(expected), std::string::npos) << report.message;
    EXPECT_NE(report.message.find("divide it into 6 elements"), std::string::npos)
        << report.message;
  }
}

/// A relaxation that nothing pushes aside ends straight, and says what it is.
TEST(BeamBucklingByRelaxation, AStraightColumnIsReportedAsASaddle) {
  for (const Beside beside : kBeside) {
    for (const ColumnEnds ends : kAllEnds) {
      for (const int elements : {2, 4, 8, 32}) {
        for (const double load : {0.9, 1.02, 1.5, 3.0, 30.0})
          expect_honest({ends, elements, load, beside}, by_relaxation);
      }
    }
  }
}

/// The discrete matrix agrees with Euler from eight elements on, to 2 %.
TEST(BeamBucklingLoads, AreEulersFromEightElementsOn) {
  for (const ColumnEnds ends : kAllEnds) {
    for (const int elements : {8, 32}) {
      for (const auto& [load, negative] : {std::pair{0.98, 0}, std::pair{1.02, 1}}) {
        const Column column{ends, elements, load};
        const BeamStructure structure(column_model(column));
        EXPECT_EQ(negative_when_straight(column, structure), negative) << text(column);
      }
    }
  }
}

/// Shapes of the elastica, but for the clamped-pinned column, whose is none of cantilevers.
TEST(BeamBucklingShapes, AreThoseOfTheElastica) {
  for (const Beside beside : kBeside) {
    for (const ColumnEnds ends : kAllEnds) {
      if (ends == ColumnEnds::kClampedPinned) continue;
      for (const double load : {1.02, 1.5}) {
        // Shortened by its load, the column buckles a little later than Euler's.
        const Column column{ends, 16, load, beside};
        const BeamSolution found = chosen(BeamStructure(column_model(column)));
        ASSERT_TRUE(found.report.converged()) << text(column) << ": " << found.report.message;
        const double known = limber::testing::elastica_deflection(column);
        EXPECT_NEAR(limber::testing::deflection(column, found.state), known,
                    (load < 1.1 ? 0.01 : 0.001) * known)
            << text(column);
        EXPECT_TRUE(found.report.snaps.empty()) << text(column);
      }
    }
  }
}

/// Of a first user: 8 elements, 1000 N, which is 2.97 times Euler's load.
TEST(BeamBucklingKnownCases, AClampedPinnedColumnUnderAThousandNewtons) {
  Column column{ColumnEnds::kClampedPinned, 8, 0};
  column.load = 1000 / limber::testing::euler_load(column.ends);
  EXPECT_NEAR(column.load, 2.97, 0.005);
  for (const Solve solve : {by_newton, chosen, by_relaxation_then_newton, followed}) {
    const BeamStructure structure(column_model(column));
    const BeamSolution found = solve(structure);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    EXPECT_GT(limber::testing::deflection(column, found.state), 0.1);
    EXPECT_EQ(negative_by_differences(structure, found.state), 0);
  }
  expect_honest(column, by_relaxation);
}

/// 1 m of 40 x 3 mm, shortened by 1 mm with its far end free to twist: 34 times Euler's load where
/// it stays straight.
TEST(BeamBucklingKnownCases, ALathFreeToTwistAtItsFarEnd) {
  for (const int elements : {8, 20}) {
    BeamModel model = limber::testing::straight_beam(elements);
    BeamMaterial wood;
    wood.young = 1e10;
    wood.poisson = 0.3;
    model.sections = {make_section(rectangle(0.04, 0.003), wood)};
    model.supports = {limber::testing::clamped(0),
                      {elements, {false, true, true, false, true, true}}};
    PrescribedMotion motion;
    motion.node = elements;
    motion.translates = {true, false, false};
    motion.translation.x() = -0.001;
    model.motions = {motion};
    const BeamStructure structure(model);
    for (const Solve solve : {by_newton, chosen, by_relaxation_then_newton, followed}) {
      const BeamSolution found = solve(structure);
      ASSERT_TRUE(found.report.converged()) << elements << ": " << found.report.message;
      // A wave of a cosine: 2 / pi of the root of what it is shortened by beyond Euler's load.
      EXPECT_NEAR(found.state.positions.row(2).cwiseAbs().maxCoeff(),
                  2 / std::numbers::pi * std::sqrt(0.001 * (1 - 1 / 34.0)), 1e-4);
      EXPECT_EQ(negative_by_differences(structure, found.state), 0);
      EXPECT_EQ(found.report.negative_eigenvalues, 0);
    }
    // Nothing pushes it aside but last digits.
    const BeamSolution relaxed = by_relaxation(structure);
    if (relaxed.report.converged())
      EXPECT_EQ(negative_by_differences(structure, relaxed.state), 0);
    else
      EXPECT_EQ(relaxed.report.status, BeamStatus::kUnstable) << relaxed.report.message;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BeamBuckling,
                         ::testing::Values(by_newton, chosen, by_relaxation_then_newton, followed),
                         [](const auto& test) -> std::string {
                           if (test.param == by_newton) return "Newton";
                           if (test.param == chosen) return "Chosen";
                           return test.param == followed ? "Followed" : "RelaxationThenNewton";
                         });

}  // namespace
}  // namespace limber::beams
