// Linkages that are opened by their pins alone, without a mean angle.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "engine/base/degrees.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;
using testing::joint_at;
using testing::LiveSession;

scene::Linkage coarse_grid() {
  scene::Linkage linkage = scene::make_linkage_sample("grid");
  linkage.edges_per_segment = 3;
  return linkage;
}

/// The grid with its corner 0 held and without a mean angle.
struct FreeGrid {
  static constexpr int kMiddle = 40, kCorner = 80;

  explicit FreeGrid(Held held) : support(held), live(coarse_grid()) {
    opened = live.edit({PinJoint{0, held}, SetMeanAngle{}});
    if (opened == nullptr) return;
    corner = joint_at(live.session, *opened, 0);
    diagonal = joint_at(live.session, *opened, kCorner) - corner;
  }
  /// The corner opposite comes to `share` of the diagonal.
  std::shared_ptr<const LinkageResult> bring(double share) {
    return live.edit({PinJoint{kCorner, support, corner + share * diagonal}});
  }
  [[nodiscard]] Eigen::Vector3d at(const LinkageResult& result, int joint) const {
    return joint_at(live.session, result, joint);
  }

  const Held support;
  LiveSession live;
  std::shared_ptr<const LinkageResult> opened;
  Eigen::Vector3d corner, diagonal;
};

bool reports_jump(const LinkageResult& result) {
  const bool has_event = std::any_of(result.path.begin(), result.path.end(), [](const auto& step) {
    return step.event == rods::BranchEvent::kJump;
  });
  return has_event && result.report.message.find("jumped") != std::string::npos;
}

/// A mechanism of rhombi: their long diagonal is as long as two sides times the cosine of half the
/// angle.
TEST(FreeOpening, APinOpensAGridWithoutEffort) {
  FreeGrid grid(Held::kMotion);
  ASSERT_TRUE(grid.opened);
  const double sides = grid.diagonal.norm() / std::cos(10 * kDegree);
  for (const double share : {0.8, 0.95}) {
    const auto result = grid.bring(share);
    ASSERT_TRUE(result);
    ASSERT_EQ(result->report.status, EquilibriumStatus::kConverged) << result->report.message;
    const Eigen::Vector3d wanted = grid.corner + share * grid.diagonal;
    EXPECT_LT((grid.at(*result, FreeGrid::kCorner) - wanted).norm(), 1e-6 * sides);
    const double angle = 2 * std::acos(share * grid.diagonal.norm() / sides);
    EXPECT_NEAR(result->mean_angle, angle, 1e-5);
    EXPECT_LT(result->report.energies.total(), 1e-9);
  }
}

TEST(FreeOpening, APinBeyondReachIsRefusedWithItsReason) {
  for (const Held held : {Held::kMotion, Held::kMotionAndAngle}) {
    FreeGrid grid(held);
    ASSERT_TRUE(grid.opened);
    const auto before = grid.bring(0.95);
    ASSERT_TRUE(before);
    const auto refused = grid.bring(1.2);
    ASSERT_TRUE(refused);
    EXPECT_TRUE(refused->solve_failed);
    EXPECT_NE(refused->report.status, EquilibriumStatus::kConverged);
    EXPECT_NE(refused->report.message.find("the rods between them are"), std::string::npos)
        << refused->report.message;
    EXPECT_LT((grid.at(*refused, FreeGrid::kMiddle) - grid.at(*before, FreeGrid::kMiddle)).norm(),
              1e-9);
  }
}

/// Buckled between corners that are clamped, it is as stable above its plane as below.
TEST(FreeOpening, JumpsToTheMirrorImageAreReported) {
  const Eigen::Vector3d mirror(1, 1, -1);
  for (const bool is_pin : {true, false}) {
    FreeGrid grid(Held::kMotionAndAngle);
    ASSERT_TRUE(grid.opened);
    const auto buckled = grid.bring(0.95);
    ASSERT_TRUE(buckled);
    ASSERT_EQ(buckled->report.status, EquilibriumStatus::kConverged) << buckled->report.message;
    const Eigen::Vector3d top = grid.at(*buckled, FreeGrid::kMiddle);
    const Eigen::Vector3d below = top.cwiseProduct(mirror);
    ASSERT_GT(std::abs(top.z()), 0.1 * grid.diagonal.norm());
    std::shared_ptr<const LinkageResult> pushed, released;
    if (is_pin) {
      pushed = grid.live.edit({PinJoint{FreeGrid::kMiddle, Held::kMotion, below}});
      ASSERT_TRUE(pushed);
      EXPECT_LT((grid.at(*pushed, FreeGrid::kMiddle) - below).norm(), 1e-6 * grid.diagonal.norm());
      released = grid.live.edit({PinJoint{FreeGrid::kMiddle, {}}});
    } else {
      scene::JointLoad load;
      load.joint = FreeGrid::kMiddle;
      load.force = Eigen::Vector3d(0, 0, top.z() > 0 ? -100 : 100);
      pushed = grid.live.edit({SetJointLoad{load}});
      load.force.setZero();
      released = grid.live.edit({SetJointLoad{load}});
    }
    ASSERT_TRUE(pushed && released);
    ASSERT_EQ(pushed->report.status, EquilibriumStatus::kConverged) << pushed->report.message;
    EXPECT_TRUE(reports_jump(*pushed)) << pushed->report.message;
    ASSERT_EQ(released->report.status, EquilibriumStatus::kConverged) << released->report.message;
    EXPECT_LT((grid.at(*released, FreeGrid::kMiddle) - below).norm(), 1e-6 * grid.diagonal.norm());
    EXPECT_NEAR(released->report.energies.total(), buckled->report.energies.total(),
                1e-9 * buckled->report.energies.total());
  }
}

}  // namespace
}  // namespace limber::session
