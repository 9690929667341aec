// Opening a linkage with the push that its design knows.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/rods/design/erection.h"
#include "engine/rods/design/starting_grid.h"
#include "engine/rods/linkage/joint_positions.h"
#include "tests/engine/rods/design/small_patches.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using testing::hyperboloid;
using testing::LiveSession;

Eigen::Matrix3Xd joints_of(const LinkageResult& result) {
  return rods::joint_positions(*result.state);
}

/// From where the linkage lies to 40 degrees farther.
std::shared_ptr<const scene::LinkageErection> push_of(double force, double from) {
  scene::JointLoad load;
  load.joint = 30;
  load.force = {0, 0, force};
  auto erection = std::make_shared<scene::LinkageErection>();
  erection->mean_angle = from + 40 * kDegree;
  erection->push = {load};
  erection->path = {from, erection->mean_angle};
  return erection;
}

std::string message_of(double force, const scene::JointLoad* load = nullptr) {
  LiveSession live(hyperboloid());
  const auto flat = live.recorder->wait_final(0);
  if (!flat) return "there is no shape";
  std::vector<LinkageEdit> edits = {PinJoint{0, scene::Held::kMotion},
                                    SetErection{push_of(force, flat->mean_angle)},
                                    SetMeanAngle{flat->mean_angle + 40 * kDegree}};
  if (load != nullptr) edits.emplace_back(SetJointLoad{*load});
  const auto opened = live.edit(edits);
  if (!opened) return "there is no result";
  EXPECT_EQ(opened->report.status, rods::EquilibriumStatus::kConverged) << opened->report.message;
  EXPECT_NEAR(opened->mean_angle, flat->mean_angle + 40 * kDegree, 1e-6);
  return opened->report.message;
}

TEST(LiveLinkageErection, APushWithoutEffectIsReportedWithWhereItStopped) {
  const std::string message = message_of(1e9);
  EXPECT_NE(message.find("the erection of this design stopped at "), std::string::npos) << message;
  EXPECT_NE(message.find("opened without its push, the shape may be on another branch"),
            std::string::npos)
      << message;
}

TEST(LiveLinkageErection, LoadsThatTheDesignDidNotHaveAreReported) {
  scene::JointLoad load;
  load.joint = 12;
  load.force = {0, 0, -1e-3};
  const std::string message = message_of(1e-3, &load);
  EXPECT_NE(message.find("found without loads, springs and weight"), std::string::npos) << message;
  const std::string alone = message_of(1e-3);
  EXPECT_EQ(alone.find("erection"), std::string::npos) << alone;
}

/// A grid that is flat without stress and opens to either side of its plane, with the push to one.
struct FlatGrid {
  explicit FlatGrid(double side) {
    const auto dome =
        rods::testing::field(12, [](double x, double y) { return 15 * (1 - x * x - y * y); });
    const rods::Rectangle strip{4, 1};
    const rods::StartingGrid grid =
        rods::starting_grid(dome, {.columns = 5, .rows = 5, .section = strip});
    linkage.lines = grid.flat;
    linkage.section = strip;
    linkage.edges_per_segment = 4;
    linkage.length_unit_in_metres = 1e-3;
    linkage.conditions.pins = {{kMiddle, scene::Held::kMotion}};
    const rods::SectionStiffness rods = rods::section_stiffness(
        rods::section_properties(strip),
        {linkage.youngs_modulus * 1e-6, linkage.poissons_ratio});  // [N/mm^2]
    const double force = 0.3 * std::min(rods.bending_1, rods.bending_2) / (280. * 280);
    push = std::make_shared<scene::LinkageErection>();
    push->mean_angle = grid.mean_angle;
    const double highest = grid.push.cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j < grid.push.size(); ++j) {
      scene::JointLoad load;
      load.joint = static_cast<int>(j);
      load.force = {0, 0, side * force * grid.push[j] / highest};
      push->push.push_back(load);
    }
  }

  /// Heights of the joints over the middle one after so many equal steps from flat to open.
  [[nodiscard]] Eigen::VectorXd heights_after(int steps) const {
    LiveSession live(linkage);
    const auto flat = live.recorder->wait_final(0);
    if (!flat) return {};
    auto erection = std::make_shared<scene::LinkageErection>(*push);
    erection->path = {flat->mean_angle, push->mean_angle};
    live.edit({SetErection{erection}});
    std::shared_ptr<const LinkageResult> result;
    for (int i = 1; i <= steps; ++i) {
      const double angle = flat->mean_angle + i * (push->mean_angle - flat->mean_angle) / steps;
      result = live.edit({SetMeanAngle{angle}});
      EXPECT_EQ(result->report.status, rods::EquilibriumStatus::kConverged)
          << result->report.message;
      EXPECT_EQ(result->report.message.find("plane"), std::string::npos) << result->report.message;
    }
    const Eigen::Matrix3Xd joints = live.session.shape()->joints(result->frames->rightCols<1>());
    return joints.row(2).array() - joints(2, kMiddle);
  }

  static constexpr int kMiddle = 12;
  scene::Linkage linkage;
  std::shared_ptr<scene::LinkageErection> push;
};

/// Steps that are each too short to leave flat for good end on the side of the push as well.
TEST(LiveLinkageErection, OpeningInSmallStepsEndsInTheShapeOfOpeningAtOnce) {
  for (const double side : {1.0, -1.0}) {
    const FlatGrid grid(side);
    const Eigen::VectorXd at_once = grid.heights_after(1);
    ASSERT_GT(at_once.cwiseAbs().maxCoeff(), 3);
    EXPECT_LT(side * at_once.mean(), 0) << "the middle is highest";
    for (const int steps : {2, 5, 12})
      EXPECT_LT((grid.heights_after(steps) - at_once).cwiseAbs().maxCoeff(), 1e-2) << steps;
  }
}

TEST(LiveLinkageErection, AShapeOnTheOtherSideOfThePlaneIsReported) {
  const FlatGrid grid(1), mirrored(-1);
  LiveSession live(grid.linkage);
  const auto flat = live.recorder->wait_final(0);
  ASSERT_TRUE(flat);
  const double path = grid.push->mean_angle - flat->mean_angle;
  const auto open = [&](const FlatGrid& to, double share) {
    auto erection = std::make_shared<scene::LinkageErection>(*to.push);
    erection->path = {flat->mean_angle, to.push->mean_angle};
    return live.edit({SetErection{erection}, SetMeanAngle{flat->mean_angle + share * path}})
        ->report.message;
  };
  EXPECT_EQ(open(mirrored, 0.9).find("other side"), std::string::npos);
  const std::string message = open(grid, 1);
  EXPECT_NE(message.find("the shape is on the other side of its plane than the designed one: "
                         "deploy it to 25 degrees"),
            std::string::npos)
      << message;
  EXPECT_EQ(open(grid, 0).find("other side"), std::string::npos);
  EXPECT_EQ(open(grid, 1).find("other side"), std::string::npos);
}

/// The same grid drawn elsewhere: its push is that of where it was designed.
TEST(LiveLinkageErection, ThePushTurnsWithTheLinkage) {
  const FlatGrid grid(1);
  const auto opened = [&](const Eigen::Matrix3d& turn, bool is_pinned) {
    scene::Linkage turned = grid.linkage;
    turned.lines.vertices = turn * grid.linkage.lines.vertices;
    if (!is_pinned) turned.conditions.pins.clear();
    LiveSession live(turned);
    const auto flat = live.recorder->wait_final(0);
    auto erection = std::make_shared<scene::LinkageErection>(*grid.push);
    erection->path = {flat->mean_angle, erection->mean_angle};
    erection->flat_positions = turn.transpose() * joints_of(*flat);
    const auto open = live.edit({SetErection{erection}, SetMeanAngle{erection->mean_angle}});
    EXPECT_EQ(open->report.status, rods::EquilibriumStatus::kConverged);
    return joints_of(*open);
  };
  const Eigen::Matrix3Xd designed = opened(Eigen::Matrix3d::Identity(), true);
  for (const double angle : {0.5, 1.6, 2.5, 3.1}) {
    for (const bool is_pinned : {true, false}) {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 0.3, -0.2).normalized()).toRotationMatrix();
      EXPECT_LT(rods::distance_between_shapes(opened(turn, is_pinned), designed), 1e-2) << angle;
    }
  }
  EXPECT_GT(rods::distance_to_mirror_image(designed, designed), 3);
}

/// With its pin and without it, which lets it float.
TEST(LiveLinkageErection, OpensToTheSameShapeAfterAnyNumberOfCycles) {
  const FlatGrid grid(1);
  for (const bool is_pinned : {true, false}) {
    scene::Linkage linkage = grid.linkage;
    if (!is_pinned) linkage.conditions.pins.clear();
    LiveSession live(linkage);
    const auto flat = live.recorder->wait_final(0);
    ASSERT_TRUE(flat);
    auto erection = std::make_shared<scene::LinkageErection>(*grid.push);
    erection->path = {flat->mean_angle, erection->mean_angle};
    live.edit({SetErection{erection}});
    Eigen::Matrix3Xd first;
    for (int cycle = 0; cycle < 50; ++cycle) {
      const auto open = live.edit({SetMeanAngle{erection->mean_angle}});
      ASSERT_EQ(open->report.status, rods::EquilibriumStatus::kConverged) << open->report.message;
      if (cycle == 0) first = joints_of(*open);
      ASSERT_LT(rods::distance_between_shapes(joints_of(*open), first), 1e-2) << cycle;
      live.edit({SetMeanAngle{flat->mean_angle}});
    }
  }
}

/// To the side for which it was not designed: the shape is said to be the mirror image.
TEST(LiveLinkageErection, AMirrorImageIsReported) {
  const FlatGrid grid(1);
  LiveSession live(grid.linkage);
  const auto flat = live.recorder->wait_final(0);
  ASSERT_TRUE(flat);
  const auto erection_to = [&](const FlatGrid& side) {
    auto erection = std::make_shared<scene::LinkageErection>(*side.push);
    erection->path = {flat->mean_angle, erection->mean_angle};
    return erection;
  };
  auto erection = erection_to(grid);
  const auto open = live.edit({SetErection{erection}, SetMeanAngle{erection->mean_angle}});
  ASSERT_TRUE(open);
  EXPECT_EQ(open->report.message.find("mirror"), std::string::npos) << open->report.message;
  auto opposite = erection_to(FlatGrid(-1));
  opposite->positions = joints_of(*open);  // it promises what its push does not lead to
  live.edit({SetMeanAngle{flat->mean_angle}});
  const auto mirrored = live.edit({SetErection{opposite}, SetMeanAngle{erection->mean_angle}});
  ASSERT_TRUE(mirrored);
  EXPECT_NE(mirrored->report.message.find("the shape is the mirror image of the designed one"),
            std::string::npos)
      << mirrored->report.message;
  opposite->positions = joints_of(*mirrored);
  live.edit({SetMeanAngle{flat->mean_angle}});
  const auto kept = live.edit({SetErection{std::make_shared<scene::LinkageErection>(*opposite)},
                               SetMeanAngle{erection->mean_angle}});
  EXPECT_EQ(kept->report.message.find("mirror"), std::string::npos) << kept->report.message;
}

/// A grid open to the side it was designed for, with a pin that may say where its joint is.
struct OpenGrid {
  explicit OpenGrid(bool has_position) : live(grid.linkage) {
    const auto flat = live.recorder->wait_final(0);
    if (!flat) return;
    auto erection = std::make_shared<scene::LinkageErection>(*grid.push);
    erection->path = {flat->mean_angle, erection->mean_angle};
    open = live.edit({SetErection{erection}, SetMeanAngle{erection->mean_angle}});
    if (!open || !has_position) return;
    const Eigen::Vector3d here = joints_of(*open).col(FlatGrid::kMiddle);
    open = live.edit({PinJoint{FlatGrid::kMiddle, scene::Held::kMotion, here}});
  }
  /// Its push, times a factor, as loads that stay.
  [[nodiscard]] std::vector<LinkageEdit> loads(double factor) const {
    std::vector<LinkageEdit> edits;
    for (scene::JointLoad load : grid.push->push) {
      load.force *= factor;
      edits.emplace_back(SetJointLoad{load});
    }
    return edits;
  }
  [[nodiscard]] bool is_mirrored(const LinkageResult& now) const {
    return rods::distance_to_mirror_image(joints_of(now), joints_of(*open)) <
           0.5 * rods::distance_between_shapes(joints_of(now), joints_of(*open));
  }
  const FlatGrid grid{1};
  LiveSession live;
  std::shared_ptr<const LinkageResult> open;
};

/// Loads that push it through its plane make it jump, which is an event of the path. A pin that
/// stays where it is moves nothing.
TEST(LiveLinkageErection, AJumpToTheMirrorImageIsReported) {
  for (const bool has_position : {false, true}) {
    OpenGrid grid(has_position);
    ASSERT_TRUE(grid.open);
    const auto pushed = grid.live.edit(grid.loads(-40));
    ASSERT_TRUE(pushed && !pushed->solve_failed) << pushed->report.message;
    ASSERT_TRUE(grid.is_mirrored(*pushed));
    EXPECT_NE(pushed->report.message.find("jumped to the mirror image"), std::string::npos)
        << pushed->report.message;
    EXPECT_TRUE(std::any_of(pushed->path.begin(), pushed->path.end(), [](const auto& step) {
      return step.event != rods::BranchEvent::kNone;
    }));
  }
}

/// Without its mean angle it balances with its pin where that was, or says that it has jumped.
TEST(LiveLinkageErection, AReleasedMeanAngleLeavesAnEquilibriumWithThePinMet) {
  for (const bool has_position : {false, true}) {
    OpenGrid grid(has_position);
    ASSERT_TRUE(grid.open);
    const auto released = grid.live.edit({SetMeanAngle{}});
    ASSERT_TRUE(released);
    ASSERT_EQ(released->report.status, rods::EquilibriumStatus::kConverged)
        << released->report.message;
    EXPECT_LT(released->report.energies.total(), grid.open->report.energies.total());
    EXPECT_EQ(grid.is_mirrored(*released),
              released->report.message.find("mirror") != std::string::npos)
        << released->report.message;
    const Eigen::Vector3d middle = joints_of(*grid.open).col(FlatGrid::kMiddle);
    EXPECT_LT((joints_of(*released).col(FlatGrid::kMiddle) - middle).norm(), 1e-6 * 280);
  }
}

TEST(LiveLinkageErection, ADesignWithoutAWayToOpenIsMarked) {
  LiveSession live(hyperboloid());
  const auto flat = live.recorder->wait_final(0);
  ASSERT_TRUE(flat);
  live.edit({SetErection{without_erection("none was found")}});
  const auto open = live.edit({SetMeanAngle{flat->mean_angle + 20 * kDegree}});
  EXPECT_NE(open->report.message.find("no way to open this design to its shape is known: none was"),
            std::string::npos)
      << open->report.message;
}

TEST(LiveLinkageErection, OtherSupportsThanTheDesignsAreWarnedOf) {
  LiveSession live(hyperboloid());
  const auto flat = live.recorder->wait_final(0);
  ASSERT_TRUE(flat);
  EXPECT_TRUE(live.session.edit({PinJoint{0, scene::Held::kMotion}}).issues.empty());
  EXPECT_TRUE(live.session.edit({SetErection{push_of(1, flat->mean_angle)}}).issues.empty());
  const EditReceipt receipt = live.session.edit({PinJoint{3, scene::Held::kMotion}});
  ASSERT_EQ(receipt.issues.size(), 1U);
  EXPECT_NE(receipt.issues[0].message.find("other supports"), std::string::npos);
}

}  // namespace
}  // namespace limber::session
