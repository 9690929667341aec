// The same structure as beams and as elastic rods: two elements that share nothing but the
// mechanics.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/beam_problems.h"
#include "tests/support/rod_problems.h"

namespace limber {
namespace {

using limber::testing::BeamEnds;
using limber::testing::Ends;

constexpr int kRodEdges = 160;
constexpr int kElements = 20;

beams::BeamState solved(const beams::BeamModel& model) {
  const beams::BeamSolution found = find_equilibrium(beams::BeamStructure(model));
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  return found.state;
}

/// Rods of plane problems lie in z = 0, beams in y = 0.
Eigen::Matrix3Xd upright(const Eigen::Matrix3Xd& rod) {
  Eigen::Matrix3Xd turned(3, rod.cols());
  turned << rod.row(0), -rod.row(2), rod.row(1);
  return turned;
}

/// The largest distance of a beam's node from a rod's centreline.
double distance(const beams::BeamState& beam, const Eigen::Matrix3Xd& rod) {
  double largest = 0;
  for (Eigen::Index n = 0; n < beam.positions.cols(); ++n) {
    const Eigen::Vector3d x = beam.positions.col(n);
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i + 1 < rod.cols(); ++i) {
      const Eigen::Vector3d edge = rod.col(i + 1) - rod.col(i);
      const double t = std::clamp((x - rod.col(i)).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (x - rod.col(i) - t * edge).norm());
    }
    largest = std::max(largest, least);
  }
  return largest;
}

TEST(BeamsAgreeWithRods, CantileverAtAlpha1) {
  const auto rod = limber::testing::cantilever(kRodEdges, 1, .30172, .05643, 1e3);
  const auto beam = solved(limber::testing::cantilever_model(kElements, 1));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 2e-5);
  EXPECT_LT(distance(beam, upright(rod.nodes)), 2e-5);
}

TEST(BeamsAgreeWithRods, CantileverAtAlpha10) {
  const auto rod = limber::testing::cantilever(kRodEdges, 10, .81061, .55500, 1e3);
  const auto beam = solved(limber::testing::cantilever_model(kElements, 10));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 5e-5);
  EXPECT_LT(distance(beam, upright(rod.nodes)), 1e-4);
}

TEST(BeamsAgreeWithRods, HingedElasticaAtSpan0_3) {
  const auto rod = limber::testing::compressed(kRodEdges, Ends::kHinged, .3, .399731);
  const auto beam = solved(limber::testing::compressed_model(kElements, BeamEnds::kHinged, .3));
  EXPECT_NEAR(beam.positions.row(2).cwiseAbs().maxCoeff(), rod.value, 1e-4);
  EXPECT_LT(distance(beam, upright(rod.nodes)), 5e-5);
}

TEST(BeamsAgreeWithRods, ClampedElasticaAtSpan0_5) {
  const auto rod = limber::testing::compressed(kRodEdges, Ends::kClamped, .5, .373306);
  const auto beam = solved(limber::testing::compressed_model(kElements, BeamEnds::kClamped, .5));
  EXPECT_NEAR(beam.positions.row(2).cwiseAbs().maxCoeff(), rod.value, 2e-4);
  EXPECT_LT(distance(beam, upright(rod.nodes)), 1e-4);
}

TEST(BeamsAgreeWithRods, FortyFiveDegreeBend) {
  const auto rod =
      limber::testing::forty_five_degree_bend(kRodEdges, 600, .1406, {46.894, 15.558, 53.604});
  const auto beam = solved(limber::testing::bend_model(kElements, 600, .1406));
  EXPECT_NEAR(beam.positions(2, kElements), rod.value, 2e-2);
  EXPECT_LT(distance(beam, rod.nodes), 2e-2);
}

}  // namespace
}  // namespace limber
