// Single rods against shooting, elliptic integrals and published tables (the sources are named in
// tests/support/rod_problems.h and below).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/rod_problems.h"

namespace limber::testing {
namespace {

/// Errors at twice as many edges are a quarter: second order, until the table's digits end.
template <class Problem>
void expect_second_order(Problem&& problem, int edges, double at_the_end) {
  double previous = 0;
  for (const int n : {edges, 2 * edges, 4 * edges}) {
    const RodAnswer answer = problem(n);
    if (previous > 0) {
      EXPECT_LT(answer.error, 0.32 * previous) << n;
      EXPECT_GT(answer.error, 0.18 * previous) << n;
    }
    previous = answer.error;
  }
  EXPECT_LT(previous, at_the_end);
}

TEST(RodKnownAnswers, CantileverUnderATipLoad) {
  struct Row {
    double alpha, deflection, shortening;
  };
  for (const Row& row : {Row{0.2, 0.06636, 0.00265}, Row{1, 0.30172, 0.05643},
                         Row{4, 0.66996, 0.32894}, Row{10, 0.81061, 0.55500}}) {
    const RodAnswer answer = cantilever(40, row.alpha, row.deflection, row.shortening);
    EXPECT_EQ(answer.report.status, rods::RodStatus::kConverged);
    EXPECT_TRUE(answer.report.stable);
    EXPECT_LT(answer.report.iterations, 12);  // the whole load at once
    EXPECT_LT(answer.error, 1e-3) << row.alpha;
  }
  expect_second_order([](int n) { return cantilever(n, 10, 0.81061, 0.55500); }, 10, 1e-3);
}

TEST(RodKnownAnswers, RollUpToACircle) {
  // The discrete energy's moment is 2 tan(phi/2) / cos^2(phi/2) for an angle phi between edges, so
  // that after a whole turn the last one is short by 2 pi (2 pi / n)^2 / 3: the model's own error.
  expect_second_order([](int n) { return roll_up(n + 1); }, 20, 2.5e-3);
  const double a = 2 * 3.14159265358979 / 40;
  EXPECT_NEAR(roll_up(41).error, a * a / 3, 0.1 * a * a / 3);
}

TEST(RodKnownAnswers, ElasticaCompressedPastVerticalEnds) {
  for (const auto& [span, height] :
       {std::pair{0.9, 0.194924}, {0.7, 0.314313}, {0.5, 0.373306}, {0.3, 0.399731}}) {
    const RodAnswer hinged = compressed(40, Ends::kHinged, span, height);
    EXPECT_EQ(hinged.report.status, rods::RodStatus::kConverged);
    EXPECT_TRUE(hinged.report.stable);
    EXPECT_LT(hinged.error, 1e-3) << span;
    EXPECT_LT(compressed(40, Ends::kClamped, span, height).error, 4e-3) << span;
  }
  expect_second_order([](int n) { return compressed(n, Ends::kClamped, 0.3, 0.399731); }, 20, 1e-3);
}

TEST(RodKnownAnswers, FortyFiveDegreeBend) {
  struct Row {
    double force, j;
    Eigen::Vector3d tip;  // of the table: along the chord, across, up
  };
  for (const Row& row :
       {Row{300, 1.0 / 6, {58.780, 22.245, 40.189}}, Row{600, 1.0 / 6, {47.152, 15.685, 53.472}},
        Row{450, 0.1406, {51.971, 18.370, 48.702}}}) {
    const RodAnswer answer = forty_five_degree_bend(40, row.force, row.j, row.tip);
    EXPECT_EQ(answer.report.status, rods::RodStatus::kConverged);
    EXPECT_LT(answer.error, 1e-3) << row.force;
  }
}

TEST(RodKnownAnswers, LocalisedHelixOfATwistedRod) {
  expect_second_order([](int n) { return localised_helix(n); }, 320, 5e-3);
}

TEST(RodKnownAnswers, TwistedRingLeavesItsPlane) {
  expect_second_order([](int n) { return ring_threshold(n); }, 10, 0.03);
}

TEST(RodKnownAnswers, TurningAnglesAreExactForArcsAndBetterElsewhere) {
  constexpr auto kTurning = rods::BendingForm::kTurningAngle;
  for (const int edges : {6, 11, 41}) EXPECT_LT(roll_up(edges, kTurning).error, 1e-7) << edges;
  EXPECT_LT(compressed(40, Ends::kHinged, 0.3, 0.399731, kTurning).error, 1e-3);
  EXPECT_LT(compressed(40, Ends::kClamped, 0.3, 0.399731, kTurning).error, 1e-3);
  EXPECT_LT(cantilever(40, 10, 0.81061, 0.55500, 1e4, kTurning).error, 4e-4);
  expect_second_order([](int n) { return ring_threshold(n, kTurning); }, 10, 0.004);
}

}  // namespace
}  // namespace limber::testing
