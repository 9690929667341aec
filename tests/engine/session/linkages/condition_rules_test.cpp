#include "engine/session/linkages/condition_rules.h"

#include <gtest/gtest.h>

#include <numbers>
#include <optional>
#include <string>

#include "engine/base/error.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::session {
namespace {

/// Nine joints and twelve segments of length 1, rods cross at 60 degrees: 3 long, sqrt(3) wide.
struct LinkageConditionRules : ::testing::Test {
  rods::LinkageGraph graph =
      rods::build_linkage_graph(rods::testing::sheared_grid(3, 3, std::numbers::pi / 3));
  ConditionRules rules{graph, 6, 1};
  scene::LinkageConditions conditions;

  /// "field code" of each issue.
  static std::string ruling_of(const std::vector<scene::Issue>& issues) {
    std::string all;
    for (const scene::Issue& issue : issues) {
      EXPECT_EQ(issue.severity, scene::Issue::Severity::kError);
      all += (all.empty() ? "" : ", ") + issue.field + " " + to_string(issue.code);
    }
    return all;
  }
  std::string checked() { return ruling_of(rules.check(conditions)); }
  std::string checked_drawn() { return ruling_of(rules.check_drawn(conditions)); }
  void pin(int joint, const std::optional<Eigen::Vector3d>& position) {
    conditions.pins.push_back({joint, scene::Held::kMotion, position});
  }
  const std::string range = std::string(" ") + to_string(ErrorCode::kOutOfRange);
  const std::string invalid = std::string(" ") + to_string(ErrorCode::kInvalidArgument);
};

TEST_F(LinkageConditionRules, OfNothingNothingIsSaid) {
  EXPECT_EQ(checked(), "");
  EXPECT_EQ(checked_drawn(), "");
}

TEST_F(LinkageConditionRules, TargetsAndPinsMayBeAMillionExtentsAway) {
  conditions.targets.push_back({1, 4, -1, 0.5, {2.9e6, 0, 0}, 1});
  EXPECT_EQ(checked(), "");
  conditions.targets.push_back({2, -1, 3, 0.5, {0, -3.1e6, 0}, 1});
  EXPECT_EQ(checked(), "targets[1].position" + range);
  conditions.targets.clear();
  pin(0, Eigen::Vector3d(0, 0, 2.9e6));
  EXPECT_EQ(checked(), "");
  conditions.pins[0].position->z() = 3.1e6;
  EXPECT_EQ(checked(), "pins[0].position" + range);
}

/// Two segments are between joints 0 and 2; a tenth more they might stretch by.
TEST_F(LinkageConditionRules, PinsMayBeAsFarApartAsTheRodsBetweenThemAreLong) {
  pin(0, Eigen::Vector3d(0, 0, 0));
  pin(5, std::nullopt);
  pin(2, Eigen::Vector3d(0, 0, 2.19));
  EXPECT_EQ(checked(), "");
  conditions.pins[2].position->z() = 2.21;
  EXPECT_EQ(checked(), "pins[2].position" + invalid);
  conditions.segment_lengths = Eigen::VectorXd::Constant(12, 1.2);
  EXPECT_EQ(checked(), "");
  conditions.pins[2].position->z() = 2.65;
  EXPECT_EQ(checked(), "pins[2].position" + invalid);
}

TEST_F(LinkageConditionRules, AsDrawnPinsWithoutPositionsAreWhereJointsAreDrawn) {
  pin(0, std::nullopt);
  pin(2, Eigen::Vector3d(0, 0, 3));  // joint 0 is drawn at the origin
  EXPECT_EQ(checked(), "");
  EXPECT_EQ(checked_drawn(), "pins[1].position" + invalid);
  conditions.pins[0].held = scene::Held::kAngle;  // holds it nowhere
  EXPECT_EQ(checked_drawn(), "");
}

TEST_F(LinkageConditionRules, SizesAreBetweenATenthAndTenTimesOfWhatIsDrawn) {
  conditions.segment_lengths = Eigen::VectorXd::Constant(12, 9.9);
  EXPECT_EQ(checked(), "");
  conditions.segment_lengths[7] = 10.1;
  EXPECT_EQ(checked(), "segment_lengths[7]" + range);
  conditions.segment_lengths = Eigen::VectorXd::Ones(12);
  conditions.segment_lengths[3] = 0.09;
  EXPECT_EQ(checked(), "segment_lengths[3]" + range);
  conditions.segment_lengths.resize(0);
  conditions.section_scales = Eigen::VectorXd::Constant(12, 0.11);
  EXPECT_EQ(checked(), "");
  conditions.section_scales[11] = 0.09;
  EXPECT_EQ(checked(), "section_scales[11]" + range);
}

/// Six for each segment; at joints two segments of a rod share one: six times, where rods pass.
TEST_F(LinkageConditionRules, EdgesAreAsManyAsThereAre) {
  constexpr int kEdges = 12 * 6 - 6;
  conditions.edge_lengths = Eigen::VectorXd::Constant(kEdges, 1.0 / 6);
  EXPECT_EQ(checked(), "");
  conditions.edge_lengths[kEdges - 1] = 2;
  EXPECT_EQ(checked(), "edge_lengths[65]" + range);
  for (const int count : {1, kEdges - 1, kEdges + 1}) {
    conditions.edge_lengths = Eigen::VectorXd::Constant(count, 1.0 / 6);
    EXPECT_EQ(checked(), "edge_lengths" + invalid) << count;
  }
}

TEST_F(LinkageConditionRules, AnAnswerTakesWhatItsNumbersTake) {
  constexpr std::size_t kVertices = 12 * 7, kJoints = 9, kSizes = 12 + 12 + 66;
  constexpr std::size_t kJointBytes = sizeof(rods::JointState<double>);
  EXPECT_EQ(rules.answer_bytes(), 2 * (1024 + 56 * kVertices + kJointBytes * kJoints + 8 * kSizes));
}

TEST_F(LinkageConditionRules, AShapeWithoutNumbersIsNone) {
  EXPECT_THROW(rules.check_shape({}), Error);
}

}  // namespace
}  // namespace limber::session
