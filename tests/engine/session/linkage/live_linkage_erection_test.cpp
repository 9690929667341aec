// Opening a linkage with the push that its design knows.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/engine/session/linkage/live_linkages.h"

namespace limber::session {
namespace {

using testing::hyperboloid;
using testing::kDegree;
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

TEST(LiveLinkageErection, APushThatLeadsNowhereIsToldWithWhereItStopped) {
  const std::string message = message_of(1e9);
  EXPECT_NE(message.find("the erection of this design stopped at "), std::string::npos) << message;
  EXPECT_NE(message.find("opened without its push, the shape may be on another branch"),
            std::string::npos)
      << message;
}

TEST(LiveLinkageErection, LoadsThatTheDesignDidNotHaveAreTold) {
  scene::JointLoad load;
  load.joint = 12;
  load.force = {0, 0, -1e-3};
  const std::string message = message_of(1e-3, &load);
  EXPECT_NE(message.find("found without loads, springs and weight"), std::string::npos) << message;
  const std::string alone = message_of(1e-3);
  EXPECT_EQ(alone.find("erection"), std::string::npos) << alone;
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
