// Straight columns beyond their buckling loads are balanced and no minima.

#include <gtest/gtest.h>

#include "tests/support/beam_columns.h"

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

/// What the straight column is follows from the second derivatives of its own energy, not from
/// Euler: with two elements a clamped-pinned column is stable at 1.02 times his load.
void expect_honest(const Column& column, Solve solve) {
  SCOPED_TRACE(text(column));
  const BeamStructure structure(column_model(column));
  const int unstable = negative_by_differences(structure, straight_state(column));
  const BeamSolution found = solve(structure);
  const BeamReport& report = found.report;
  if (unstable == 0) {
    EXPECT_TRUE(report.converged()) << report.message;
    EXPECT_TRUE(is_straight_and_pressed(column, found.state));
    EXPECT_EQ(report.negative_eigenvalues, 0);
  } else if (is_straight_and_pressed(column, found.state) && report.negative_eigenvalues) {
    EXPECT_EQ(report.status, BeamStatus::kUnstable) << report.message;
    EXPECT_EQ(report.negative_eigenvalues, unstable);
  } else if (report.converged()) {
    EXPECT_FALSE(is_straight_and_pressed(column, found.state));
    EXPECT_EQ(negative_by_differences(structure, found.state), 0) << "it is no minimum";
    EXPECT_EQ(report.negative_eigenvalues, 0);
  } else {
    EXPECT_FALSE(report.message.empty());
  }
}

class BeamBuckling : public ::testing::TestWithParam<Solve> {};

TEST_P(BeamBuckling, NoStraightColumnBeyondItsLoadIsAMinimum) {
  for (const Beside beside : kBeside) {
    for (const ColumnEnds ends : kAllEnds) {
      for (const int elements : {2, 4, 8, 16, 32}) {
        for (const double load : {0.9, 1.02, 1.5, 3.0, 30.0}) {
          // Long ways for nothing.
          const bool is_slow = GetParam() != by_newton && load == 30;
          if (!is_slow || elements == 8) expect_honest({ends, elements, load, beside}, GetParam());
        }
      }
    }
  }
}

/// A relaxation that nothing pushes aside ends straight, and says what it is.
TEST(BeamBucklingByRelaxation, AStraightColumnIsSaidToBeASaddle) {
  for (const Beside beside : kBeside) {
    for (const ColumnEnds ends : kAllEnds) {
      for (const int elements : {2, 8}) {
        for (const double load : {0.9, 1.5, 3.0})
          expect_honest({ends, elements, load, beside}, by_relaxation);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Ways, BeamBuckling,
                         ::testing::Values(by_newton, chosen, by_relaxation_then_newton, followed),
                         [](const auto& test) -> std::string {
                           if (test.param == by_newton) return "Newton";
                           if (test.param == chosen) return "Chosen";
                           return test.param == followed ? "Followed" : "RelaxationThenNewton";
                         });

}  // namespace
}  // namespace limber::beams
