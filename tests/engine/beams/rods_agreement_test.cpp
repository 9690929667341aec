// The same structure as beams and as elastic rods: two elements that share nothing but the
// mechanics.

#include <gtest/gtest.h>

#include "tests/support/beam_problems.h"
#include "tests/support/rod_problems.h"

namespace limber {
namespace {

using testing::BeamEnds;
using testing::Ends;

constexpr int kRodEdges = 160;
constexpr int kElements = 20;

beams::BeamState solved(const beams::BeamModel& model) {
  const beams::BeamSolution found = find_equilibrium(beams::BeamStructure(model));
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  return found.state;
}

TEST(BeamsAgreeWithRods, CantileverAtAlpha1) {
  const auto rod = testing::cantilever(kRodEdges, 1, .30172, .05643, 1e3);
  const auto beam = solved(testing::cantilever_model(kElements, 1));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 2e-5);
}

TEST(BeamsAgreeWithRods, CantileverAtAlpha10) {
  const auto rod = testing::cantilever(kRodEdges, 10, .81061, .55500, 1e3);
  const auto beam = solved(testing::cantilever_model(kElements, 10));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 5e-5);
}

TEST(BeamsAgreeWithRods, HingedElasticaAtSpan0_3) {
  const auto rod = testing::compressed(kRodEdges, Ends::kHinged, .3, .399731);
  const auto beam = solved(testing::compressed_model(kElements, BeamEnds::kHinged, .3));
  EXPECT_NEAR(beam.positions.row(2).cwiseAbs().maxCoeff(), rod.value, 1e-4);
}

TEST(BeamsAgreeWithRods, ClampedElasticaAtSpan0_5) {
  const auto rod = testing::compressed(kRodEdges, Ends::kClamped, .5, .373306);
  const auto beam = solved(testing::compressed_model(kElements, BeamEnds::kClamped, .5));
  EXPECT_NEAR(beam.positions.row(2).cwiseAbs().maxCoeff(), rod.value, 2e-4);
}

TEST(BeamsAgreeWithRods, FortyFiveDegreeBend) {
  const auto rod = testing::forty_five_degree_bend(kRodEdges, 600, .1406, {46.894, 15.558, 53.604});
  const auto beam = solved(testing::bend_model(kElements, 600, .1406));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 2e-2);
}

}  // namespace
}  // namespace limber
