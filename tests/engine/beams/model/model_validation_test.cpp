#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>

#include "engine/base/error.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using limber::testing::cantilever_model;

struct BadInput {
  const char* name;
  const char* field;
  ErrorCode code;
  std::function<void(BeamModel&)> spoil;
};

class BeamModelValidation : public ::testing::TestWithParam<BadInput> {};

TEST_P(BeamModelValidation, NamesTheField) {
  BeamModel model = cantilever_model(4, 1);
  ASSERT_NO_THROW(validate(model));
  GetParam().spoil(model);
  try {
    validate(model);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_EQ(error.code(), GetParam().code);
    EXPECT_NE(std::string(error.what()).find(GetParam().field), std::string::npos) << error.what();
  }
}

constexpr auto kInvalid = ErrorCode::kInvalidArgument;
constexpr auto kRange = ErrorCode::kOutOfRange;
constexpr auto kPrecondition = ErrorCode::kFailedPrecondition;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What hinges do not take, a support may; and a hinge of one beam leaves the other one.
TEST(BeamMoments, AreTakenWhereABeamOrASupportHoldsTheNode) {
  BeamModel model = cantilever_model(4, 1);
  model.elements[1].finish_release.rotations = {true, true, true};
  model.loads.push_back({2, {0, 0, 0}, {0, 50, 0}});
  EXPECT_NO_THROW(validate(model)) << "element 2 takes it";
  model.elements[2].start_release.rotations = {false, true, false};
  EXPECT_THROW(validate(model), Error);
  model.supports.push_back({2, {false, false, false, false, true, false}});
  EXPECT_NO_THROW(validate(model)) << "the support takes it";
  model.supports.pop_back();
  model.loads[1].moment = {3, 0, 2};
  EXPECT_NO_THROW(validate(model)) << "across the hinge";
}

INSTANTIATE_TEST_SUITE_P(
    Bad, BeamModelValidation,
    ::testing::Values(
        BadInput{"ZeroLengthElement", "elements[2]", kInvalid,
                 [](BeamModel& m) { m.nodes[3].position = m.nodes[2].position; }},
        BadInput{"ElementFromANodeToItself", "elements[1]", kInvalid,
                 [](BeamModel& m) { m.elements[1].finish = 1; }},
        BadInput{"DuplicateElement", "elements[4]", kInvalid,
                 [](BeamModel& m) {
                   m.elements.push_back(m.elements[1]);
                   std::swap(m.elements[4].start, m.elements[4].finish);
                 }},
        BadInput{"SectionNotPositive", "sections[0]", kInvalid,
                 [](BeamModel& m) { m.sections[0].bending_3 = 0; }},
        BadInput{"SectionNotANumber", "sections[0]", kInvalid,
                 [](BeamModel& m) { m.sections[0].stretching = kNaN; }},
        BadInput{"TwistOfMoreThanAnElementShowsAtRest", "elements[1].rest_curvature", kInvalid,
                 [](BeamModel& m) { m.elements[1].rest_curvature.x() = 10; }},
        BadInput{"MissingSection", "elements[3].section", kRange,
                 [](BeamModel& m) { m.elements[3].section = 1; }},
        BadInput{"LoadOnMissingNode", "loads[0].node", kRange,
                 [](BeamModel& m) { m.loads[0].node = 5; }},
        BadInput{"LoadOnMissingElement", "distributed_loads[0].element", kRange,
                 [](BeamModel& m) {
                   m.distributed_loads.push_back({-1, {0, 0, 1}});
                 }},
        BadInput{"LoadWhoseSquareOverflows", "loads[0].force", kInvalid,
                 [](BeamModel& m) { m.loads[0].force.x() = 1e200; }},
        BadInput{"FarFromTheOrigin", "nodes[0].position", kInvalid,
                 [](BeamModel& m) {
                   for (auto& node : m.nodes) node.position.x() += 1e9;
                 }},
        BadInput{"LoadNotANumber", "loads[0].force", kInvalid,
                 [](BeamModel& m) { m.loads[0].force.x() = kNaN; }},
        BadInput{"MomentOnABallJoint", "loads[1].moment", kInvalid,
                 [](BeamModel& m) {
                   m.elements[1].finish_release.rotations = {true, true, true};
                   m.elements[2].start_release.rotations = {true, true, true};
                   m.loads.push_back({2, {0, 0, 0}, {0, 50, 0}});
                 }},
        BadInput{"MomentAboutAHingeOfAllBeams", "temporary_loads[0].moment", kInvalid,
                 [](BeamModel& m) {
                   m.elements[1].finish_release.rotations = {false, true, false};
                   m.elements[2].start_release.rotations = {false, true, true};
                   m.temporary_loads.push_back({2, {0, 0, 0}, {1, 0.1, 0}});
                 }},
        BadInput{"MomentAtTheHingedEndOfABeam", "loads[1].moment", kInvalid,
                 [](BeamModel& m) {
                   m.elements[3].finish_release.rotations = {false, false, true};
                   m.loads.push_back({4, {0, 0, 0}, {0, 0, 1}, LoadDirection::kFollowing});
                 }},
        BadInput{"MomentBetweenCables", "loads[1].moment", kInvalid,
                 [](BeamModel& m) {
                   for (const std::size_t i : {1, 2}) m.elements[i].kind = BeamKind::kCable;
                   m.loads.push_back({2, {0, 0, 0}, {0, 50, 0}});
                 }},
        BadInput{"NoSupports", "supports", kPrecondition, [](BeamModel& m) { m.supports.clear(); }},
        BadInput{"AnIslandWithoutSupport", "nodes[5]", kPrecondition,
                 [](BeamModel& m) {
                   m.nodes.push_back(m.nodes[3]);
                   m.nodes.push_back(m.nodes[4]);
                   m.elements.push_back(m.elements[3]);
                   m.elements[4].start = 5;
                   m.elements[4].finish = 6;
                 }},
        BadInput{"LoadOnANodeOfNoElement", "loads[0].node", kInvalid,
                 [](BeamModel& m) { m.elements.pop_back(); }},
        BadInput{"LeftHandedAxes", "supports[0].axes", kInvalid,
                 [](BeamModel& m) { m.supports[0].axes(2, 2) = -1; }},
        BadInput{"SkewAxes", "supports[0].axes", kInvalid,
                 [](BeamModel& m) { m.supports[0].axes(0, 1) = 0.1; }},
        BadInput{"NormalAlongTheElement", "elements[0].normal", kInvalid,
                 [](BeamModel& m) { m.elements[0].normal = Eigen::Vector3d(-2, 0, 0); }},
        BadInput{"CableWithHinge", "elements[0]", kInvalid,
                 [](BeamModel& m) {
                   m.elements[0].kind = BeamKind::kCable;
                   m.elements[0].start_release.rotations[1] = true;
                 }},
        BadInput{"TwistReleasedAtBothEnds", "elements[0].finish_release", kInvalid,
                 [](BeamModel& m) {
                   m.elements[0].start_release.rotations[0] = true;
                   m.elements[0].finish_release.rotations[0] = true;
                 }}),
    [](const auto& test) { return test.param.name; });

PrescribedMotion motion_of(int node) {
  PrescribedMotion motion;
  motion.node = node;
  return motion;
}
/// Of the free end; by x and y turned about z.
BeamSupport askew_support(std::size_t fixed) {
  BeamSupport support;
  support.node = 4;
  support.fixed[fixed] = true;
  support.axes << 0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1;
  return support;
}
void translate(BeamModel& m, int node, const std::array<bool, 3>& which) {
  PrescribedMotion motion = motion_of(node);
  motion.translates = which;
  m.motions.push_back(motion);
}
void rotate(BeamModel& m, int node, const std::array<bool, 3>& which) {
  PrescribedMotion motion = motion_of(node);
  motion.rotates = which;
  m.motions.push_back(motion);
}

INSTANTIATE_TEST_SUITE_P(
    BadMotions, BeamModelValidation,
    ::testing::Values(BadInput{"AgainstASupport", "motions[0]", kInvalid,
                               [](BeamModel& m) {
                                 translate(m, 0, {true, false, false});
                               }},
                      BadInput{"RotationAgainstASupport", "motions[0]", kInvalid,
                               [](BeamModel& m) {
                                 rotate(m, 0, {true, true, true});
                               }},
                      BadInput{"TwoOfANode", "motions[1].node", kInvalid,
                               [](BeamModel& m) {
                                 m.motions = {motion_of(3), motion_of(3)};
                               }},
                      BadInput{"OfANodeOfNoElement", "motions[0].node", kInvalid,
                               [](BeamModel& m) {
                                 m.loads.clear();
                                 m.elements.pop_back();
                                 translate(m, 4, {true, true, true});
                               }},
                      BadInput{"AcrossLocalAxes", "motions[0]", kInvalid,
                               [](BeamModel& m) {
                                 m.supports.push_back(askew_support(0));
                                 translate(m, 4, {true, false, false});
                               }},
                      BadInput{"RotationAcrossLocalAxes", "motions[0]", kInvalid,
                               [](BeamModel& m) {
                                 m.supports.push_back(askew_support(5));
                                 rotate(m, 4, {false, true, false});
                               }},
                      BadInput{"LocalAgainstASupport", "motions[0]", kInvalid,
                               [](BeamModel& m) {
                                 m.supports.push_back(askew_support(1));
                                 translate(m, 4, {false, true, false});
                                 m.motions[0].axes = m.supports[1].axes;
                               }},
                      BadInput{"SkewAxes", "motions[0].axes", kInvalid,
                               [](BeamModel& m) {
                                 translate(m, 3, {true, true, true});
                                 m.motions[0].axes(0, 1) = 0.1;
                               }}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace limber::beams
