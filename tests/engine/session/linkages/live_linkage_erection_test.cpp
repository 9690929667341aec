// Opening a linkage with the push that its design knows.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "engine/base/degrees.h"
#include "engine/rods/design/starting_grid.h"
#include "tests/engine/rods/design/small_patches.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using testing::hyperboloid;
using testing::LiveSession;

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
