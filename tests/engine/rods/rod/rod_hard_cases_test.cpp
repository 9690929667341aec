#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/rotations/exponential_map.h"
#include "tests/support/rod_equilibrium.h"
#include "tests/support/rod_problems.h"
#include "tests/support/single_rod.h"

namespace limber::rods {
namespace {

constexpr auto kConverged = RodStatus::kConverged;
constexpr SectionStiffness kFlatRod{1e4, 2.0, 0.5, 0.8};

Eigen::Matrix3Xd helix(int edges) {
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i) nodes.col(i) << std::cos(0.4 * i), std::sin(0.4 * i), 0.1 * i;
  return nodes;
}
Eigen::Matrix3Xd straight(int edges, double h) {
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  for (int i = 0; i <= edges; ++i) nodes(0, i) = i * h;
  return nodes;
}
std::vector<char> fixed_edges(const Rod& rod, const std::vector<int>& edges) {
  std::vector<char> result(static_cast<std::size_t>(rod.layout->unknowns()), 0);
  for (const int e : edges)
    for (int i = 4 * e; i < 4 * e + 7; ++i) result[static_cast<std::size_t>(i)] = 1;
  return result;
}

TEST(RodHardCases, UnloadedArcStaysPutInAnyDirection) {
  const Eigen::Matrix3d turn = rotations::exponential({0.3, 1.9, -0.7});
  const Rod rod(turn * helix(20), kFlatRod);
  const auto found = find_equilibrium(rod.drawn, rod.parameters, {}, fixed_edges(rod, {0}));
  EXPECT_EQ(found.report.status, kConverged);
  EXPECT_EQ(found.report.iterations, 0);
  EXPECT_TRUE(found.report.stable);
}

TEST(RodHardCases, CurvatureAndTwistAtRestComeBack) {
  // Pulled straight and released.
  const Rod rod(helix(20), kFlatRod);
  Eigen::VectorXd x = rod.drawn.unknowns();
  const Eigen::Vector3d start = x.segment<3>(0), along = x.segment<3>(4) - start;
  for (int i = 2; i <= 20; ++i) x.segment<3>(4 * i) = start + i * along;
  for (int i = 1; i < 20; ++i) x[4 * i + 3] = 0.2 * i;
  const auto found =
      find_equilibrium(RodAtSource(rod.drawn).moved(x), rod.parameters, {}, fixed_edges(rod, {0}));
  EXPECT_EQ(found.report.status, kConverged);
  EXPECT_LT(found.report.energies.total(), 1e-12);
  EXPECT_LT(
      (found.at.state().unknowns().segment<3>(80) - rod.drawn.unknowns().segment<3>(80)).norm(),
      1e-6);
}

TEST(RodHardCases, StraightDrawnRodRollsIntoItsArcByItself) {
  // 2 tan(phi/2) per vertex about d1 (kappa_2): an arc out of the plane of d1.
  Rod rod(straight(12, 0.1), kFlatRod, {.rest = RestShape::kStraight, .first_director = {0, 0, 1}});
  const double phi = 3.14159265358979 / 11;
  for (int i = 1; i < 12; ++i) {
    rod.parameters(i, RodParameters::kRestBefore1) = 2 * std::tan(phi / 2);
    rod.parameters(i, RodParameters::kRestAfter1) = 2 * std::tan(phi / 2);
  }
  const auto found = find_equilibrium(rod.drawn, rod.parameters, {}, fixed_edges(rod, {0}));
  EXPECT_EQ(found.report.status, kConverged);
  EXPECT_LT(found.report.energies.total(), 1e-12);
  const auto last = found.at.state().frame(11).tangent;
  EXPECT_NEAR(last.x, -1, 1e-8);  // half a circle
}

TEST(RodHardCases, EdgesAlmostFoldedBackUnfold) {
  for (const double missing : {1e-2, 1e-4, 1e-6}) {
    Eigen::Matrix3Xd nodes = straight(4, 1);
    const double c = std::cos(missing), s = std::sin(missing);
    nodes.col(3) = nodes.col(2) + Eigen::Vector3d(-c, s, 0);
    nodes.col(4) = nodes.col(3) + Eigen::Vector3d(-c, s, 0);
    const Rod rod(nodes, kFlatRod, {.rest = RestShape::kStraight});
    EXPECT_TRUE(rod.drawn.is_finite());
    EXPECT_GT(rod.drawn.energy(rod.parameters), 1 / (missing * missing));
    const auto found = find_equilibrium(rod.drawn, rod.parameters, {}, fixed_edges(rod, {0}));
    EXPECT_EQ(found.report.status, kConverged) << missing;
    EXPECT_LT(found.report.energies.total(), 1e-10) << missing;
  }
}

TEST(RodHardCases, EndsPushedTogetherAndPastEachOther) {
  // Two edges as a hairpin: the energy keeps them from folding flat.
  const Rod rod(straight(2, 1), kFlatRod, {.rest = RestShape::kStraight});
  std::vector<char> fixed(12, 0);
  for (const int i : {0, 1, 2, 6, 8, 9, 10}) fixed[static_cast<std::size_t>(i)] = 1;
  Eigen::VectorXd x = rod.drawn.unknowns();
  RodState state = rod.drawn;
  for (const double span : {1.9, 1.0, 0.3, 0.1, 0.03}) {
    x = state.unknowns();
    x[8] = span;
    if (x[5] == 0) x[5] = 0.1;
    const auto found = find_equilibrium(RodAtSource(state).moved(x), rod.parameters, {}, fixed);
    EXPECT_EQ(found.report.status, kConverged) << span;
    state = found.at.state();
    EXPECT_TRUE(std::isfinite(found.report.energies.total()));
  }
  EXPECT_GT(state.strains(1).before_1 * state.strains(1).before_1 +
                state.strains(1).before_2 * state.strains(1).before_2,
            400);
}

TEST(RodHardCases, EdgesOfAThousandthOfTheirRestLengthExpand) {
  const Rod drawn(helix(12), kFlatRod);
  const Rod tiny(1e-3 * helix(12), kFlatRod);
  const auto found = find_equilibrium(
      RodState(drawn.layout, drawn.drawn.shared_source(), tiny.drawn.unknowns()), drawn.parameters,
      {}, std::vector<char>(static_cast<std::size_t>(drawn.layout->unknowns()), 0));
  EXPECT_EQ(found.report.status, kConverged);
  EXPECT_LT(found.report.energies.total(), 1e-10);
}

TEST(RodHardCases, SlendernessFromTenToTenThousand) {
  for (const double slenderness : {10.0, 100.0, 1000.0, 10000.0}) {
    const auto answer = limber::testing::cantilever(40, 1, 0.30172, 0.05643, slenderness);
    EXPECT_EQ(answer.report.status, kConverged) << slenderness;
    // Stretching: P L / E A = alpha / (12 slenderness^2) of the length, at most.
    EXPECT_LT(answer.error, 3e-4 + 1 / (12 * slenderness * slenderness)) << slenderness;
  }
}

TEST(RodHardCases, MillimetresAndMegapascalsGiveTheShapeOfMetresAndPascals) {
  const auto metres = limber::testing::cantilever_shape(30, 4, 2e11, 1.5, 0.01);
  const auto millimetres = limber::testing::cantilever_shape(30, 4, 2e5, 1500, 10);
  EXPECT_EQ(metres.report.status, kConverged);
  EXPECT_EQ(millimetres.report.status, kConverged);
  EXPECT_EQ(metres.report.iterations, millimetres.report.iterations);
  for (int i = 0; i <= 30; ++i) {
    const Eigen::Vector3d a = 1000 * metres.at.state().unknowns().segment<3>(4 * i);
    EXPECT_LT((a - millimetres.at.state().unknowns().segment<3>(4 * i)).norm(), 1e-6) << i;
  }
}

TEST(RodHardCases, TwistOfManyTurnsStaysInAFixedStraightRod) {
  const Rod rod(straight(10, 0.1), kFlatRod, {.rest = RestShape::kStraight});
  std::vector<char> fixed(static_cast<std::size_t>(rod.layout->unknowns()), 1);
  for (int i = 1; i < 9; ++i) fixed[static_cast<std::size_t>(4 * i + 3)] = 0;
  Eigen::VectorXd x = rod.drawn.unknowns();
  RodState state = rod.drawn;
  for (int quarter = 1; quarter <= 80; ++quarter) {  // twenty turns
    x = state.unknowns();
    x[4 * 9 + 3] = quarter * 3.14159265358979 / 2;
    const auto found = find_equilibrium(RodAtSource(state).moved(x), rod.parameters, {}, fixed);
    ASSERT_EQ(found.report.status, kConverged);
    state = found.at.state();
  }
  const double twist = 40 * 3.14159265358979;
  EXPECT_NEAR(state.energy(rod.parameters), 0.5 * 0.8 * twist * twist / 0.9, 1e-6);
}

TEST(RodHardCases, StraightRodUnderMoreThanItsCriticalLoadBuckles) {
  // Hinged, inextensible: P_cr = pi^2 B; at 1.2 of it the spans of the elastica apply.
  const SectionStiffness stiff{1e7, 2, 1, 1};
  const Rod rod(straight(40, 1.0 / 40), stiff);
  std::vector<char> fixed(static_cast<std::size_t>(rod.layout->unknowns()), 0);
  for (const int i : {0, 1, 2, 3, 161, 162}) fixed[static_cast<std::size_t>(i)] = 1;
  RodLoads loads;
  loads.forces = Eigen::Matrix3Xd::Zero(3, 41);
  const double critical = 9.8696;
  loads.forces(0, 40) = -0.9 * critical;
  const auto below = find_equilibrium(rod.drawn, rod.parameters, loads, fixed);
  EXPECT_TRUE(below.report.stable);
  EXPECT_NEAR(below.at.state().unknowns()[160], 1, 1e-5);
  loads.forces(0, 40) = -1.1807 * critical;  // span .7
  const auto stopped =
      find_equilibrium(rod.drawn, rod.parameters, loads, fixed, {.at_saddle = AtSaddle::kStop});
  EXPECT_EQ(stopped.report.status, kConverged);
  EXPECT_FALSE(stopped.report.stable);
  const auto buckled = find_equilibrium(rod.drawn, rod.parameters, loads, fixed);
  EXPECT_EQ(buckled.report.status, kConverged);
  EXPECT_TRUE(buckled.report.stable);
  EXPECT_EQ(buckled.report.saddles_left, 1);
  EXPECT_NEAR(buckled.at.state().unknowns()[160], 0.7, 0.01);
  // About the weak axis, which is d1: the middle moves along d2.
  const auto d2 = rod.drawn.frame(0).d2;
  const Eigen::Vector3d middle = buckled.at.state().unknowns().segment<3>(80);
  EXPECT_NEAR(std::abs(middle.dot(Eigen::Vector3d(d2.x, d2.y, d2.z))), 0.314313, 0.005);
}

TEST(RodHardCases, WrongInputIsNamed) {
  const Rod rod(straight(4, 1), kFlatRod);
  const auto fixed = fixed_edges(rod, {0});
  const auto field_of = [&](const RodLoads& loads, const std::vector<char>& held,
                            const RodEquilibriumOptions& options) {
    try {
      (void)find_equilibrium(rod.drawn, rod.parameters, loads, held, options);
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(field_of({}, fixed, {}), "accepted");
  EXPECT_EQ(field_of({}, {1}, {}), "fixed");
  RodLoads loads;
  loads.forces = Eigen::Matrix3Xd::Zero(3, 2);
  EXPECT_EQ(field_of(loads, fixed, {}), "loads.forces");
  EXPECT_EQ(field_of({}, fixed, {.tolerance = 0}), "tolerance");
  EXPECT_EQ(field_of({}, fixed, {.max_iterations = 0}), "max_iterations");
  EXPECT_THROW(Rod(straight(0, 1), kFlatRod), Error);
  EXPECT_THROW(Rod(straight(3, 1), SectionStiffness{1, 1, -1, 1}), Error);
}

}  // namespace
}  // namespace limber::rods
