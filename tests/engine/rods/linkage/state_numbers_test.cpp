#include "engine/rods/linkage/state_numbers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_state.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/engine/rods/linkage/state_charts.h"

namespace limber::rods {
namespace {

LinkageState bent(const LinkageModel& model) {
  Random random(7);
  return LinkageState(model).moved(
      model, testing::random_increment(model.variables().size(), 0.2, random));
}

/// Joints of valence 2 to 4, rods that end free, and one that is no joint's.
LinkageModel large_mixed_model() {
  LineMesh mesh = testing::mixed_mesh();
  mesh.vertices *= 40;
  return {build_linkage_graph(mesh), 5, testing::kStrip};
}

void expect_same(const LinkageModel& model, const LinkageState& is, const LinkageState& was) {
  ASSERT_EQ(is.joints().size(), was.joints().size());
  for (std::size_t j = 0; j < was.joints().size(); ++j) {
    EXPECT_EQ(is.joints()[j].position, was.joints()[j].position);
    EXPECT_EQ(is.joints()[j].opening_angle, was.joints()[j].opening_angle);
    EXPECT_LT((is.joints()[j].bisector - was.joints()[j].bisector).norm(), 1e-15);
  }
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int i = 0; i <= model.variables().edges(s); ++i) {
      EXPECT_LT((is.vertex(model, s, i) - was.vertex(model, s, i)).norm(), 1e-13);
      if (i == model.variables().edges(s)) continue;
      EXPECT_LT((is.director(model, s, i) - was.director(model, s, i)).norm(), 1e-14);
      if (i > 0) {
        EXPECT_NEAR(is.twist(model, s, i), was.twist(model, s, i), 1e-13);
      }
    }
  }
  LinkageAssembly assembly(model);
  const double energy = assembly.energies(was).total();
  ASSERT_GT(energy, 1);
  EXPECT_NEAR(assembly.energies(is).total(), energy, 1e-11 * energy);
}

TEST(StateNumbers, AStateComesBack) {
  for (const LinkageModel& model :
       {testing::curved_model(), testing::grid_model(3, 2, 1.2), large_mixed_model()}) {
    const LinkageState state = bent(model);
    expect_same(model, LinkageState(model, state.numbers(model)), state);
  }
}

/// Frames know twists up to whole rounds.
TEST(StateNumbers, TwistBeyondAWholeRoundComesBack) {
  const LinkageModel model = testing::grid_model(3, 3, 1.5);
  LinkageState state = bent(model);
  Eigen::VectorXd turn = Eigen::VectorXd::Zero(model.variables().size());
  turn.segment<3>(model.variables().joint_begin(4) + kJointRotation) =
      2 * state.joints()[4].tangent(kRodA);
  for (int times = 0; times < 24; ++times) state = state.moved(model, turn);
  double largest = 0;
  for (int s = 0; s < model.variables().segments(); ++s)
    for (int i = 1; i < model.variables().edges(s); ++i)
      largest = std::max(largest, std::abs(state.twist(model, s, i)));
  ASSERT_GT(largest, 4) << "beyond what angles of frames can say";
  expect_same(model, LinkageState(model, state.numbers(model)), state);
}

TEST(StateNumbers, RoundedNumbersAreMadeOrthonormal) {
  const LinkageModel model = testing::curved_model();
  const LinkageState state = bent(model);
  StateNumbers numbers = state.numbers(model);
  numbers.normals = numbers.normals.cast<float>().cast<double>();
  numbers.bisectors = numbers.bisectors.cast<float>().cast<double>();
  numbers.directors = numbers.directors.cast<float>().cast<double>();
  const LinkageState rounded(model, numbers);
  for (const auto& joint : rounded.joints()) {
    EXPECT_NEAR(joint.normal.norm(), 1, 1e-15);
    EXPECT_NEAR(joint.bisector.norm(), 1, 1e-15);
    EXPECT_NEAR(joint.normal.dot(joint.bisector), 0, 1e-15);
  }
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int e = 0; e < model.variables().edges(s); ++e) {
      const Eigen::Vector3d edge = rounded.vertex(model, s, e + 1) - rounded.vertex(model, s, e);
      EXPECT_NEAR(rounded.director(model, s, e).norm(), 1, 1e-15);
      EXPECT_NEAR(rounded.director(model, s, e).dot(edge.normalized()), 0, 1e-14);
    }
  }
}

TEST(StateNumbers, WhatIsNoShapeOfTheLinkageIsRefusedByName) {
  const LinkageModel model = large_mixed_model();
  const StateNumbers good = LinkageState(model).numbers(model);
  const auto refused = [&](const char* field, const std::function<void(StateNumbers&)>& spoil) {
    StateNumbers numbers = good;
    spoil(numbers);
    try {
      const LinkageState state(model, numbers);
      ADD_FAILURE() << field << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), field) << error.what();
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    }
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  refused("positions", [](auto& n) { n.positions.resize(3, 0); });
  refused("positions", [](auto& n) { n.positions(1, 0) = nan; });
  refused("positions", [](auto& n) { n.positions(1, 0) = 1e200; });
  refused("normals", [](auto& n) { n.normals *= 2; });
  refused("bisectors", [](auto& n) { n.bisectors = n.normals; });
  refused("opening_angles", [](auto& n) { n.opening_angles.resize(3); });
  refused("lengths", [](auto& n) { n.lengths(1, 0) = 0; });
  refused("vertices", [](auto& n) { n.vertices.conservativeResize(3, n.vertices.cols() - 1); });
  refused("vertices", [](auto& n) { n.vertices.col(1) = n.vertices.col(0); });
  refused("directors", [](auto& n) { n.directors.setZero(); });
  refused("directors", [](auto& n) { n.directors.setConstant(0.57735); });
  refused("twists", [](auto& n) { n.twists[3] = nan; });
  refused("twists", [](auto& n) { n.twists.conservativeResize(n.twists.size() + 1); });
}

}  // namespace
}  // namespace limber::rods
