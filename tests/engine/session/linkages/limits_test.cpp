// What sessions of linkages cannot reach, and refuse.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/session/linkages/mapping.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;
using testing::hyperboloid;
using testing::joint_at;
using testing::LinkageRecorder;
using testing::LiveSession;

TEST(LinkageSession, WhatCannotBeReachedLeavesTheLastEquilibrium) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  scene::JointLoad load;
  load.joint = 3;
  load.force = {0, 0, 1};  // nothing holds the linkage: it would fly away
  const auto flying = live.edit({SetJointLoad{load}});
  ASSERT_TRUE(flying);
  EXPECT_TRUE(flying->solve_failed);
  EXPECT_NE(flying->report.message.find("requested: a force of 1 N at joint 3"), std::string::npos)
      << flying->report.message;
  EXPECT_TRUE(flying->frames->allFinite());
  EXPECT_LT((joint_at(live.session, *flying, 40) - joint_at(live.session, *opened, 40)).norm(),
            1e-6);
  const auto held = live.edit({PinJoint{0, Held::kMotion}});
  ASSERT_TRUE(held);
  EXPECT_EQ(held->report.status, EquilibriumStatus::kConverged) << held->report.message;
}

TEST(LinkageSession, APathThatEndsShowsHowFarItWent) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto stopped = live.edit({SetMeanAngle{178 * kDegree}});
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(stopped->solve_failed);
  EXPECT_NE(stopped->report.message.find("% of the requested change"), std::string::npos)
      << stopped->report.message;
  EXPECT_NE(stopped->report.message.find("requested: a mean angle of 178 degrees"),
            std::string::npos)
      << stopped->report.message;
  EXPECT_GT(stopped->path.size(), 5U);
  EXPECT_EQ(stopped->frames->cols(), static_cast<Eigen::Index>(stopped->path.size()));
  EXPECT_NEAR(stopped->mean_angle, stopped->path.back().mean_opening_angle, 1e-9);
  EXPECT_GT(stopped->mean_angle, opened->mean_angle + 0.5);
  EXPECT_LT(stopped->report.max_gradient_scaled, 1e-3);  // of the shape that is shown
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_NEAR(undone->mean_angle, opened->mean_angle, 1e-9);
}

TEST(LinkageSession, NoJointTurnsOver) {
  scene::Linkage dome = scene::make_linkage_sample("dome");
  dome.conditions = {};
  LiveSession live(dome);
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  // Opened between corners that stay where they are it has nowhere to go.
  std::vector<LinkageEdit> edits;
  for (const int corner : {0, 8, 72, 80}) edits.emplace_back(PinJoint{corner, Held::kMotion});
  ASSERT_TRUE(live.edit(edits));
  const auto wound = live.edit({SetMeanAngle{60 * kDegree}});
  ASSERT_TRUE(wound);
  const Eigen::Index joints =
      static_cast<Eigen::Index>(live.session.geometry()->vertex_of_joint.size());
  for (Eigen::Index k = 0; k < wound->frames->cols(); ++k)
    EXPECT_LT(wound->frames->col(k).tail(joints).cwiseAbs().maxCoeff(), 225.1 * kDegree) << k;
  EXPECT_TRUE(wound->solve_failed);
  EXPECT_NE(wound->report.message.find("turn over"), std::string::npos) << wound->report.message;
}

TEST(LinkageSession, PinsFartherApartThanTheRodsBetweenThemAreRefused) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  try {
    live.session.edit({PinJoint{3, Held::kMotion, Eigen::Vector3d(0, 0, 0)},
                       PinJoint{4, Held::kMotion, Eigen::Vector3d(0, 0, 500)}});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(error.field(), "edits[1].position");
    EXPECT_NE(std::string(error.what()).find("joints 3 and 4"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(live.session.conditions()->pins.empty());
}

TEST(LinkageSession, APinFartherThanRodsReachFromOneThatStaysIsReported) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  ASSERT_TRUE(live.edit({PinJoint{3, Held::kMotion}}));
  const auto good = live.session.final_result();
  const auto torn = live.edit({PinJoint{4, Held::kMotion, Eigen::Vector3d(0, 0, 500)}});
  ASSERT_TRUE(torn);
  EXPECT_TRUE(torn->solve_failed);
  EXPECT_NE(torn->report.message.find("joints 3 and 4"), std::string::npos) << torn->report.message;
  EXPECT_EQ(torn->frames->rightCols(1), good->frames->rightCols(1));
  scene::Linkage drawn = hyperboloid();
  drawn.conditions.pins = {{3, Held::kMotion}, {4, Held::kMotion, Eigen::Vector3d(0, 0, 500)}};
  const LinkageCheck check = check_linkage(drawn);
  ASSERT_EQ(check.issues.size(), 1u);
  EXPECT_EQ(check.issues[0].field, "conditions.pins[1].position");
}

TEST(LinkageSession, TargetsAndPinsFartherThanAMillionLengthsAreRefused) {
  scene::Linkage drawn = hyperboloid();
  const Eigen::Vector3d size =
      drawn.lines.vertices.rowwise().maxCoeff() - drawn.lines.vertices.rowwise().minCoeff();
  const double extent = size.maxCoeff();
  const Eigen::Vector3d near(0, 0, 0.99e6 * extent), far(0, 0, 1.01e6 * extent);
  LiveSession live(drawn);
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::LinkageTarget of_joint;
  of_joint.joint = 5;
  of_joint.stiffness = 1e-9;
  of_joint.position = near;
  const EditReceipt added = live.session.edit({AddTarget{of_joint}});
  live.session.cancel();
  const auto good = live.session.conditions();
  of_joint.position = far;
  scene::LinkageTarget of_segment = of_joint;
  of_segment.joint = -1;
  of_segment.segment = 7;
  scene::LinkageTarget replaced = of_joint;
  replaced.id = added.constraint_ids[0];
  const std::vector<std::pair<LinkageEdit, const char*>> edits = {
      {AddTarget{of_joint}, "the target of joint 5"},
      {AddTarget{of_segment}, "the target of segment 7 (share 0.5)"},
      {MoveTarget{replaced.id, far}, "the target of joint 5"},
      {ReplaceTarget{replaced}, "the target of joint 5"},
      {PinJoint{3, Held::kMotion, far}, "the pin of joint 3"}};
  for (const auto& [edit, what] : edits) {
    try {
      live.session.edit({edit});
      ADD_FAILURE() << what;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kOutOfRange);
      EXPECT_EQ(error.field(), "edits[0].position");
      const std::string text = error.what();
      EXPECT_NE(text.find(what), std::string::npos) << text;
      EXPECT_NE(text.find(" m is farther than 1e+06 lengths of the linkage"), std::string::npos)
          << text;
    }
    EXPECT_EQ(live.session.conditions(), good) << what;
  }
  drawn.conditions.targets = {of_segment};
  const LinkageCheck check = check_linkage(drawn);
  ASSERT_EQ(check.issues.size(), 1u);
  EXPECT_EQ(check.issues[0].field, "conditions.targets[0].position");
  EXPECT_EQ(check.issues[0].code, ErrorCode::kOutOfRange);
}

/// Two rods joined by their ends lie straight at 180 degrees, where nothing crosses.
TEST(LinkageSession, RodsJoinedByTheirEndsSwingThroughStraight) {
  scene::Linkage corner;
  corner.lines.vertices.resize(3, 3);
  corner.lines.vertices << 0, 1, 1, 0, 0, 1, 0, 0, 0;
  corner.lines.edges.resize(2, 2);
  corner.lines.edges << 0, 1, 1, 2;
  LiveSession live(corner);
  ASSERT_TRUE(live.recorder->wait_final(0));
  std::vector<LinkageEdit> edits;
  for (const double share : {0.0, 0.3, 0.6}) {
    scene::LinkageTarget foot;
    foot.segment = 0;
    foot.share = share;
    foot.position = {share, 0, 0};
    foot.stiffness = 1e5;
    edits.emplace_back(AddTarget{foot});
  }
  scene::LinkageTarget tip;
  tip.segment = 1;
  tip.share = 1;
  tip.position = {1, 1, 0};
  tip.stiffness = 1e3;
  edits.emplace_back(AddTarget{tip});
  const EditReceipt receipt = live.session.edit(edits);
  ASSERT_TRUE(live.recorder->wait_final(receipt.revision));
  const std::uint64_t id = receipt.constraint_ids.back();
  for (int direction = 80; direction >= -80; direction -= 10) {
    const double turn = direction * kDegree;
    const auto there =
        live.edit({MoveTarget{id, Eigen::Vector3d(1 + std::cos(turn), std::sin(turn), 0)}});
    ASSERT_TRUE(there);
    EXPECT_FALSE(there->solve_failed) << direction << ": " << there->report.message;
  }
}

TEST(LinkageSession, ALinkageFarFromTheOriginIsRefused) {
  scene::Linkage far = hyperboloid();
  far.lines.vertices.row(0).array() += 1e6;
  test::Pool pool{1};
  try {
    LinkageSession("far", far, {}, pool.executor(), nullptr);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "lines");
  }
}

TEST(LinkageSession, APinFarAwayIsReachedInABoundedNumberOfSteps) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const Eigen::Vector3d far(50, 0, 0);
  const auto there = live.edit({PinJoint{0, Held::kMotion, far}});
  ASSERT_TRUE(there);
  EXPECT_LE(static_cast<int>(there->path.size()), 400);
  EXPECT_FALSE(there->solve_failed) << there->report.message;
  EXPECT_LT((joint_at(live.session, *there, 0) - far).norm(), 1e-3);
}

TEST(LinkageSession, BadLinkagesAreRefusedWithTheirField) {
  const auto refuse = [](const char* field, const std::function<void(scene::Linkage&)>& spoil) {
    scene::Linkage linkage = hyperboloid();
    spoil(linkage);
    test::Pool pool{1};
    const auto recorder = std::make_shared<LinkageRecorder>();
    try {
      const LinkageSession session("bad", linkage, {}, pool.executor(), recorder);
      // What only the build knows is reported by the state.
      EXPECT_TRUE(recorder->wait_state(State::kFailed)) << field;
      EXPECT_NE(recorder->message().find(field), std::string::npos)
          << field << ": " << recorder->message();
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), field);
    }
  };
  refuse("lines.edges[3]", [](auto& l) { l.lines.edges(1, 3) = 999; });
  refuse("conditions.pins[0].joint", [](auto& l) { l.conditions.pins = {{99, Held::kMotion}}; });
  refuse("section.width", [](auto& l) { l.section = rods::Rectangle{-1, 0.01}; });
  refuse("material.youngs_modulus", [](auto& l) { l.youngs_modulus = 0; });
  refuse("edges_per_segment", [](auto& l) { l.edges_per_segment = 2; });
}

}  // namespace
}  // namespace limber::session
