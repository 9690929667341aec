#include "engine/beams/structure/subdivision.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/structure/node_loads.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::clamped;
using limber::testing::straight_beam;

double largest_distance(const BeamState& a, const BeamState& b, int nodes) {
  return (a.positions.leftCols(nodes) - b.positions.leftCols(nodes)).colwise().norm().maxCoeff();
}

/// Two beams in a corner with uneven sections, a hinge between them and a cable across.
BeamModel corner() {
  BeamModel model = straight_beam(1);
  model.sections[0].bending_3 = 4;
  model.nodes.push_back({Eigen::Vector3d(1, 1, 0), Eigen::Vector3d(0, 0, 2)});
  BeamElement second;
  second.start = 1;
  second.finish = 2;
  second.start_release.rotations = {false, false, true};
  second.rest_curvature = {0.1, 0.2, 0};
  second.rest_length = 1.1;
  model.elements.push_back(second);
  BeamElement cable;
  cable.start = 0;
  cable.finish = 2;
  cable.kind = BeamKind::kCable;
  model.elements.push_back(cable);
  model.supports.push_back(clamped(0));
  model.distributed_loads.push_back({1, {0, 0.1, -0.2}});
  return model;
}

TEST(Subdivision, NumbersPartsAndTheNodesBetweenThem) {
  const BeamModel model = corner();
  const Subdivision cut(model, {2, 4, 3});
  EXPECT_EQ(cut.parts(), (std::vector{2, 4, 1})) << "cables stay whole";
  EXPECT_EQ(cut.elements(), 7);
  EXPECT_EQ(cut.node_count(), 3 + 1 + 3);
  EXPECT_EQ(cut.first_part(1), 2);
  EXPECT_EQ(cut.node(0, 1), 3);
  EXPECT_EQ(cut.node(1, 0), 1);
  EXPECT_EQ(cut.node(1, 3), 6);
  EXPECT_EQ(cut.node(1, 4), 2);
  EXPECT_EQ(cut.nearest_node(1), 1);
  EXPECT_EQ(cut.nearest_node(4), 1);
  EXPECT_EQ(cut.nearest_node(6), 2);
  EXPECT_EQ(cut.element_of_part(1), 0);
  EXPECT_EQ(cut.element_of_part(2), 1);
  EXPECT_EQ(cut.element_of_part(6), 2);
  EXPECT_FALSE(cut.is_whole());
  EXPECT_TRUE(Subdivision::even(model, 1).is_whole());
  EXPECT_EQ(cut.halved(model), Subdivision(model, {4, 8, 1}));
  EXPECT_THROW(Subdivision(model, {1, 1}), Error);
  EXPECT_THROW(Subdivision(model, {1, 0, 1}), Error);
}

TEST(Subdivision, PartsHaveTheRestShapeAndTheLoadsOfTheirElement) {
  const BeamModel model = corner();
  const Subdivision subdivision(model, {2, 4, 1});
  const BeamModel cut = cut_model(model, subdivision);
  const BeamStructure whole(model), parts(cut);
  for (int part = 0; part < parts.elements(); ++part) {
    const int e = subdivision.element_of_part(part);
    const int count = subdivision.parts_of(e);
    EXPECT_NEAR(parts.constants(part).length, whole.constants(e).length / count, 1e-15);
    EXPECT_LT((parts.rest_axes(part) - whole.rest_axes(e)).norm(), 1e-14) << part;
    EXPECT_EQ(cut.elements[static_cast<std::size_t>(part)].rest_curvature,
              model.elements[static_cast<std::size_t>(e)].rest_curvature);
  }
  ASSERT_EQ(parts.released_ends().size(), 1U);
  EXPECT_EQ(parts.released_ends()[0].element, 2);
  EXPECT_EQ(parts.released_ends()[0].node, 1);
  const NodeLoads before = NodeLoads::of(model), after = NodeLoads::of(cut);
  EXPECT_LT((before.forces.rowwise().sum() - after.forces.rowwise().sum()).norm(), 1e-14);
  EXPECT_EQ(element_name(cut, 3), "element 1, part 2 of 4");
  EXPECT_EQ(element_name(cut, 6), "element 2");
  EXPECT_EQ(node_name(cut, 5), "a point inside of element 1");
  EXPECT_EQ(node_name(cut, 2), "node 2");
}

TEST(Subdivision, AnUncutModelIsTheSame) {
  const BeamModel model = corner();
  const BeamModel same = cut_model(model, Subdivision::even(model, 1));
  EXPECT_EQ(same.elements.size(), model.elements.size());
  EXPECT_TRUE(same.element_parts.empty());
  EXPECT_EQ(same.elements[0].normal, model.elements[0].normal);
}

TEST(Subdivision, CutElementsAnswerAsElementsDrawnSoShort) {
  const BeamModel coarse = limber::testing::cantilever_model(4, 10);
  const BeamSolution cut =
      find_equilibrium(BeamStructure(cut_model(coarse, Subdivision::even(coarse, 5))));
  const BeamSolution drawn =
      find_equilibrium(BeamStructure(limber::testing::cantilever_model(20, 10)));
  ASSERT_TRUE(cut.report.converged() && drawn.report.converged());
  for (int i = 0; i <= 4; ++i)
    EXPECT_LT((cut.state.positions.col(i) - drawn.state.positions.col(5 * i)).norm(), 1e-7) << i;
}

TEST(CarryState, NodesInBetweenAreOnTheArcOfTheirElement) {
  const BeamModel model = limber::testing::roll_up_model(12);
  const BeamStructure structure(model);
  const BeamState circle = find_equilibrium(structure).state;
  const Subdivision whole = Subdivision::even(model, 1), cut = Subdivision::even(model, 4);
  const BeamState carried = carry_state(structure, whole, circle, cut);
  EXPECT_EQ(largest_distance(circle, carried, 13), 0);
  const double radius = 1 / (2 * 3.14159265358979);
  for (int i = 0; i < carried.nodes(); ++i) {
    const Eigen::Vector3d from_centre = carried.positions.col(i) - Eigen::Vector3d(0, 0, radius);
    EXPECT_NEAR(from_centre.norm(), radius, 2e-4) << i;
    const Eigen::Vector3d along =
        carried.rotations[static_cast<std::size_t>(i)] * Eigen::Vector3d(Eigen::Vector3d::UnitX());
    EXPECT_NEAR(along.dot(from_centre) / radius, 0, 2e-3) << i;
  }
  // Back again, by way of parts that are no multiples.
  const BeamStructure fine(cut_model(model, cut));
  const Subdivision thirds = Subdivision::even(model, 3);
  const BeamState third = carry_state(fine, cut, carried, thirds);
  const BeamState back = carry_state(BeamStructure(cut_model(model, thirds)), thirds, third, whole);
  EXPECT_EQ(back.nodes(), 13);
  EXPECT_EQ(largest_distance(circle, back, 13), 0);
}

TEST(CarryState, HingesStayAsTheyAre) {
  BeamModel model = corner();
  model.loads.push_back({2, {0.3, 0, -0.1}});
  const BeamStructure structure(model);
  const BeamSolution found = find_equilibrium(structure);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  const Subdivision cut(model, {3, 5, 1});
  const BeamState carried = carry_state(structure, Subdivision::even(model, 1), found.state, cut);
  ASSERT_EQ(carried.hinge_turns.size(), 1U);
  const BeamSolution finer = find_equilibrium_from(BeamStructure(cut_model(model, cut)), carried);
  ASSERT_TRUE(finer.report.converged()) << finer.report.message;
  EXPECT_LT(largest_distance(found.state, finer.state, 3), 0.02);
  EXPECT_LT(finer.state.hinge_turns[0].angularDistance(found.state.hinge_turns[0]), 0.05);
}

}  // namespace
}  // namespace limber::beams
