#include "engine/beams/model/beam_model.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::cantilever_model;
using limber::testing::clamped;

/// A cantilever from the origin towards `tip`, stiffer about axis 3 than about axis 2.
BeamModel member(const Eigen::Vector3d& tip, int elements = 1) {
  BeamModel model = cantilever_model(elements, 0);
  for (int i = 0; i <= elements; ++i)
    model.nodes[static_cast<std::size_t>(i)].position = tip * i / elements;
  model.sections[0].bending_2 = 1;
  model.sections[0].bending_3 = 4;
  return model;
}

Eigen::Vector3d leaning(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {std::sin(angle), 0, std::cos(angle)};
}

TEST(BeamModel, ANodeThatIsFixedAndMovedAlongTheSameAxisIsMoved) {
  BeamModel model = cantilever_model(8, 0);
  PrescribedMotion motion;
  motion.node = 0;
  motion.translates = {true, false, true};
  motion.translation = {0.25, 0, 0.5};
  model.motions.push_back(motion);
  give_motions_precedence(model);
  EXPECT_EQ(model.supports[0].fixed, (std::array{false, true, false, true, true, true}));
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  const Eigen::Vector3d by = found.state.positions.col(8) - model.nodes[8].position;
  EXPECT_LT((by - Eigen::Vector3d(0.25, 0, 0.5)).norm(), 1e-9);
}

TEST(BeamModel, RotationsThatAreFixedAndMovedAreMovedAndOthersStayFixed) {
  BeamModel model = cantilever_model(2, 0);
  model.supports.push_back(clamped(2));
  PrescribedMotion motion;
  motion.node = 2;
  motion.rotates = {false, true, false};
  model.motions.push_back(motion);
  give_motions_precedence(model);
  EXPECT_EQ(model.supports[0].fixed, clamped(0).fixed) << "of another node";
  EXPECT_EQ(model.supports[1].fixed, (std::array{true, true, true, true, false, true}));
  EXPECT_NO_THROW(validate(model));
}

TEST(BeamModel, AVerticalMemberGetsANormalByRule) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(drawn_normal(member(z), 0), x);
  EXPECT_EQ(drawn_normal(member(-z), 0), x);
  EXPECT_EQ(drawn_normal(member(leaning(0.09)), 0), x) << "vertical within 0.1 degrees";
  EXPECT_EQ(drawn_normal(member(leaning(0.11)), 0).normalized(), z);
  const Eigen::Matrix3d frame = drawn_frame(member(z), 0);
  EXPECT_EQ(frame.col(0), z);
  EXPECT_EQ(frame.col(1), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(frame.col(2), x);
}

TEST(BeamModel, NormalsOfNodesAlongAMemberOrAgainstEachOtherAreReplacedByTheRule) {
  BeamModel model = member(Eigen::Vector3d::UnitX());
  for (BeamNode& node : model.nodes) node.normal = Eigen::Vector3d(3, 0, 0);
  EXPECT_EQ(drawn_normal(model, 0), Eigen::Vector3d::UnitZ());
  model.nodes[0].normal = Eigen::Vector3d(0, 1, 0);
  model.nodes[1].normal = Eigen::Vector3d(0, -2, 0);
  EXPECT_EQ(drawn_normal(model, 0), Eigen::Vector3d::UnitZ());
  model.elements[0].normal = Eigen::Vector3d(0, 5, 0);
  EXPECT_EQ(drawn_normal(model, 0), Eigen::Vector3d(0, 5, 0));
}

/// Axis 3 is along x, so what bends towards x bends about axis 2: four times as far as towards y.
TEST(BeamModel, AVerticalMemberBendsAboutTheAxesOfTheRule) {
  const auto deflection = [](const Eigen::Vector3d& force) {
    BeamModel model = member(Eigen::Vector3d::UnitZ(), 4);
    model.loads = {{4, force, Eigen::Vector3d::Zero()}};
    const BeamSolution found = find_equilibrium(BeamStructure(model));
    EXPECT_TRUE(found.report.converged()) << found.report.message;
    return (found.state.positions.col(4) - model.nodes[4].position).dot(force.normalized());
  };
  EXPECT_NEAR(deflection({0.003, 0, 0}), 0.001, 1e-7);
  EXPECT_NEAR(deflection({0, 0.003, 0}), 0.00025, 1e-7);
}

}  // namespace
}  // namespace limber::beams
