#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::BeamEnds;

class BeamKnownAnswers : public ::testing::TestWithParam<BeamMethod> {
 protected:
  [[nodiscard]] static BeamSolveOptions options() {
    BeamSolveOptions result;
    result.method = GetParam();
    return result;
  }
};

TEST_P(BeamKnownAnswers, CantileverTable) {
  // alpha, w/L, u/L by elliptic integrals.
  const double table[][3] = {
      {0.2, .06636, .00265}, {1, .30172, .05643}, {3, .60325, .25442}, {10, .81061, .55500}};
  for (const auto& [alpha, w, u] : table) {
    const auto answer = limber::testing::beam_cantilever(20, alpha, w, u, options());
    EXPECT_TRUE(answer.report.converged()) << answer.report.message;
    EXPECT_LT(answer.error, 2e-5) << alpha;  // the table has five digits
  }
}

TEST_P(BeamKnownAnswers, RollUpClosesToACircle) {
  const auto answer = limber::testing::beam_roll_up(20, options());
  EXPECT_TRUE(answer.report.converged()) << answer.report.message;
  EXPECT_LT(answer.error, 1e-4);
}

TEST_P(BeamKnownAnswers, CompressedElasticaPastNinetyDegrees) {
  for (const BeamEnds ends : {BeamEnds::kHinged, BeamEnds::kClamped}) {
    const auto answer = limber::testing::beam_compressed(20, ends, 0.3, .399731, options());
    EXPECT_TRUE(answer.report.converged()) << answer.report.message;
    EXPECT_LT(answer.error, 1e-4);
  }
}

TEST_P(BeamKnownAnswers, FortyFiveDegreeBendInItsUnits) {
  struct Case {
    double force, torsion;
    Eigen::Vector3d tip;
  };
  // Our x is along the beam's start, y towards the centre.
  for (const Case& c : {Case{300, 1.0 / 6, {58.780, 22.245, 40.189}},
                        {450, 1.0 / 6, {52.240, 18.509, 48.500}},
                        {600, 1.0 / 6, {47.152, 15.685, 53.472}},
                        {600, .1406, {46.894, 15.558, 53.604}}}) {
    const auto answer = limber::testing::beam_bend(20, c.force, c.torsion, c.tip, options());
    EXPECT_TRUE(answer.report.converged()) << answer.report.message;
    EXPECT_LT(answer.error, 2.5e-4) << c.force;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BeamKnownAnswers,
                         ::testing::Values(BeamMethod::kNewton, BeamMethod::kRelaxation,
                                           BeamMethod::kRelaxationThenNewton, BeamMethod::kChoose),
                         [](const auto& test) {
                           switch (test.param) {
                             case BeamMethod::kNewton:
                               return "Newton";
                             case BeamMethod::kRelaxation:
                               return "Relaxation";
                             case BeamMethod::kRelaxationThenNewton:
                               return "RelaxationThenNewton";
                             default:
                               return "Chosen";
                           }
                         });

/// A quarter of a ring, clamped, with a small force at its tip across its plane: P R^3 (pi / (4 E
/// I) + (3 pi / 4 - 2) / (G J)), by Castigliano's theorem. Most of it is torsion where G is small.
TEST(BeamQuarterRing, OfTimberSinksByItsOwnShearModulus) {
  const double radius = 1.5, force = 0.2;
  for (const double shear : {0.69e9, 4.2e9}) {
    BeamMaterial timber;
    timber.young = 11e9;
    timber.shear_modulus = shear;
    BeamModel model;
    model.sections = {make_section(rectangle(0.05, 0.03), timber)};
    const int parts = 32;
    for (int i = 0; i <= parts; ++i) {
      const double angle = std::numbers::pi / 2 * i / parts;
      model.nodes.push_back({{radius * std::sin(angle), radius * (1 - std::cos(angle)), 0}});
      if (i == parts) break;
      BeamElement e;
      e.start = i;
      e.finish = i + 1;
      model.elements.push_back(e);
    }
    model.supports = {limber::testing::clamped(0)};
    model.loads = {{parts, {0, 0, -force}}};
    const BeamSolution found = find_equilibrium(BeamStructure(model));
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const BeamSection& s = model.sections[0];
    const double sinks =
        force * std::pow(radius, 3) *
        (std::numbers::pi / (4 * s.bending_2) + (0.75 * std::numbers::pi - 2) / s.torsion);
    EXPECT_NEAR(-found.state.positions(2, parts), sinks, 2e-3 * sinks) << shear;
  }
}

TEST(BeamConvergence, ErrorFallsAtLeastWithTheSquareOfTheElements) {
  const auto closing = [](int n) { return limber::testing::beam_roll_up(n).error; };
  EXPECT_GT(closing(5) / closing(10), 12);
  EXPECT_GT(closing(10) / closing(20), 12);
  const auto bend = [](int n) {
    return limber::testing::beam_bend(n, 600, 1.0 / 6, {47.152, 15.685, 53.472}).error;
  };
  EXPECT_GT(bend(5) / bend(10), 3.6);
  EXPECT_GT(bend(10) / bend(20), 3.6);
}

TEST(BeamConvergence, WithoutBowingIsOfSecondOrder) {
  const auto error = [](int n) {
    BeamModel model = limber::testing::roll_up_model(n);
    model.bowing = Bowing::kLeftOut;
    model.loads[0].moment *= 0.5;  // a half circle: u/L = -1, v/L = 2/pi
    const BeamSolution found = find_equilibrium(BeamStructure(model));
    EXPECT_TRUE(found.report.converged()) << found.report.message;
    return (found.state.positions.col(n) - Eigen::Vector3d(0, 0, 0.63661977236758134)).norm();
  };
  EXPECT_NEAR(error(10) / error(20), 4, 0.3);
}

}  // namespace
}  // namespace limber::beams
