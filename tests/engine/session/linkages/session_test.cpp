// A linkage that is held in equilibrium while it is edited.

#include <gtest/gtest.h>

#include "engine/base/degrees.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;
using testing::hyperboloid;
using testing::joint_at;
using testing::LiveSession;

TEST(LinkageSession, OpensInEquilibriumAndDeploysStepByStep) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->report.status, EquilibriumStatus::kConverged) << opened->report.message;
  EXPECT_TRUE(opened->frames->allFinite());
  EXPECT_EQ(opened->frames->rows(), live.session.geometry()->coordinates);
  const double drawn = opened->mean_angle;
  const auto deployed = live.edit({SetMeanAngle{drawn + 20 * kDegree}});
  ASSERT_TRUE(deployed);
  EXPECT_EQ(deployed->report.status, EquilibriumStatus::kConverged) << deployed->report.message;
  EXPECT_FALSE(deployed->solve_failed);
  EXPECT_NEAR(deployed->mean_angle, drawn + 20 * kDegree, 1e-6);
  EXPECT_GE(deployed->path.size(), 8U);
  EXPECT_EQ(deployed->frames->cols(), static_cast<Eigen::Index>(deployed->path.size()));
  double before = drawn;
  for (const rods::DeploymentStep& step : deployed->path) {
    EXPECT_EQ(step.event, rods::BranchEvent::kNone);
    EXPECT_NEAR(step.mean_opening_angle, drawn + step.progress * 20 * kDegree, 1e-9);
    EXPECT_GT(step.mean_opening_angle, before);
    before = step.mean_opening_angle;
  }
  // Back again: the same shape, as far as its place in space goes.
  const auto closed = live.edit({SetMeanAngle{{}}});
  ASSERT_TRUE(closed);
  EXPECT_NEAR(closed->report.energies.total(), opened->report.energies.total(),
              1e-5 * deployed->report.energies.total());
  EXPECT_FALSE(live.recorder->has_gap());
}

/// Height of all joints' bounding box, over its width.
double flatness(const LinkageSession& session, const LinkageResult& result) {
  Eigen::Vector3d low = joint_at(session, result, 0), high = low;
  for (int j = 0; j < static_cast<int>(session.geometry()->vertex_of_joint.size()); ++j) {
    const Eigen::Vector3d at = joint_at(session, result, j);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Eigen::Vector3d size = high - low;
  return size.minCoeff() / size.maxCoeff();
}

TEST(LinkageSession, SamplesDeploy) {
  for (const std::string& name : scene::linkage_sample_names()) {
    LiveSession live(scene::make_linkage_sample(name));
    const auto opened = live.recorder->wait_final(0);
    ASSERT_TRUE(opened) << name;
    EXPECT_EQ(opened->report.status, EquilibriumStatus::kConverged)
        << name << ": " << opened->report.message;
    const auto deployed = live.edit({SetMeanAngle{60 * kDegree}});
    ASSERT_TRUE(deployed) << name;
    EXPECT_EQ(deployed->report.status, EquilibriumStatus::kConverged)
        << name << ": " << deployed->report.message;
    EXPECT_NEAR(deployed->mean_angle, 60 * kDegree, 1e-6) << name;
    const double flat = flatness(live.session, *deployed);
    if (name == "grid") {  // a mechanism in its plane
      EXPECT_LT(flat, 1e-6);
      EXPECT_LT(deployed->report.energies.total(), 1e-9);
    } else {
      EXPECT_GT(flat, 0.1) << name;
      EXPECT_GT(deployed->report.energies.total(), opened->report.energies.total()) << name;
    }
  }
}

/// Mean of all vertices of a shape.
Eigen::Vector3d middle(const LinkageSession& session, const Eigen::VectorXd& shape) {
  const auto geometry = session.geometry();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Index at = 0, count = 0;
  for (const int edges : geometry->edges) {
    for (int i = 0; i <= edges; ++i, ++count)
      sum += shape.segment<3>(at + 3 * Eigen::Index{i}).cast<double>();
    at += 6 * Eigen::Index{edges} + 3;
  }
  return sum / static_cast<double>(count);
}

TEST(LinkageSession, WhatFloatsStaysWhereItIsWhileItDeploys) {
  LiveSession live(hyperboloid());  // all joints are equally far from its middle
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  // Drawn about the axis z.
  const Eigen::Vector3d drawn = middle(live.session, opened->frames->rightCols<1>());
  EXPECT_LT(drawn.head<2>().norm(), 1e-4);
  const auto deployed = live.edit({SetMeanAngle{50 * kDegree}});
  ASSERT_TRUE(deployed);
  ASSERT_EQ(deployed->report.status, EquilibriumStatus::kConverged) << deployed->report.message;
  ASSERT_GT(deployed->frames->cols(), 10);
  for (Eigen::Index frame = 0; frame < deployed->frames->cols(); ++frame)
    EXPECT_LT((middle(live.session, deployed->frames->col(frame)) - drawn).norm(), 1e-4) << frame;
  // One solve does not move it either.
  const auto a_little = live.edit({SetMeanAngle{51 * kDegree}});
  ASSERT_TRUE(a_little);
  EXPECT_LT((middle(live.session, a_little->frames->rightCols<1>()) - drawn).norm(), 1e-4);
}

TEST(LinkageSession, AJointFollowsItsTargetWhileOthersArePinned) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  constexpr int kBottom = 0, kTop = 83;
  const Eigen::Vector3d top = joint_at(live.session, *opened, kTop);
  scene::LinkageTarget target;
  target.joint = kTop;
  target.position = top + Eigen::Vector3d(0.02, 0.01, 0);
  target.stiffness = 1e6;
  const auto pulled = live.edit({PinJoint{kBottom, Held::kMotion}, AddTarget{target}});
  ASSERT_TRUE(pulled);
  EXPECT_EQ(pulled->report.status, EquilibriumStatus::kConverged) << pulled->report.message;
  EXPECT_LT(
      (joint_at(live.session, *pulled, kBottom) - joint_at(live.session, *opened, kBottom)).norm(),
      1e-6);
  EXPECT_LT((joint_at(live.session, *pulled, kTop) - target.position).norm(), 2e-3);
  const auto moved = live.edit({MoveTarget{1, top + Eigen::Vector3d(0.03, 0.01, 0)}});
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->report.status, EquilibriumStatus::kConverged) << moved->report.message;
  EXPECT_LT((joint_at(live.session, *moved, kTop) - top - Eigen::Vector3d(0.03, 0.01, 0)).norm(),
            3e-3);
  const auto undone = live.edit({Undo{}, Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_NEAR(undone->report.energies.total(), opened->report.energies.total(),
              1e-5 * pulled->report.energies.total());
}

TEST(LinkageSession, DeploysByTorquesStepByStepAndBack) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto joints = static_cast<int>(live.session.geometry()->vertex_of_joint.size());
  std::vector<LinkageEdit> push, release;
  const auto angle = live.edit({SetMeanAngle{opened->mean_angle + 15 * kDegree}});
  ASSERT_TRUE(angle);
  const double torque = angle->report.mean_angle_moment;
  for (int j = 0; j < joints; ++j) {
    push.emplace_back(SetJointLoad{{j, {0, 0, 0}, {0, 0, 0}, torque}});
    release.emplace_back(SetJointLoad{{j, {0, 0, 0}, {0, 0, 0}, 0}});
  }
  const auto closed = live.edit({SetMeanAngle{std::nullopt}});
  ASSERT_TRUE(closed);
  const auto pushed = live.edit(push);
  ASSERT_TRUE(pushed);
  EXPECT_EQ(pushed->report.status, EquilibriumStatus::kConverged) << pushed->report.message;
  EXPECT_GE(pushed->path.size(), 4U);
  EXPECT_EQ(pushed->frames->cols(), static_cast<Eigen::Index>(pushed->path.size()));
  EXPECT_NEAR(pushed->mean_angle, angle->mean_angle, 1e-4);
  for (const rods::DeploymentStep& step : pushed->path)
    EXPECT_EQ(step.event, rods::BranchEvent::kNone);
  const auto back = live.edit(release);
  ASSERT_TRUE(back);
  EXPECT_GE(back->path.size(), 4U);
  EXPECT_NEAR(back->mean_angle, closed->mean_angle, 1e-4);
}

TEST(LinkageSession, UndoRestoresTheShapeAfterAnyPath) {
  // A mechanism: where it goes and comes back to depends on the path.
  scene::Linkage grid = scene::make_linkage_sample("grid");
  grid.edges_per_segment = 4;
  LiveSession live(grid);
  ASSERT_TRUE(live.recorder->wait_final(0));
  const auto open = live.edit({SetMeanAngle{60 * kDegree}});
  ASSERT_TRUE(open);
  ASSERT_TRUE(live.edit({SetMeanAngle{std::nullopt}, PinJoint{0, Held::kMotionAndAngle}}));
  ASSERT_TRUE(live.edit({SetMeanAngle{20 * kDegree}}));
  ASSERT_TRUE(live.edit({Undo{}}));
  const auto back = live.edit({Undo{}});
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->mean_angle, 60 * kDegree, 1e-6);
  for (const int joint : {0, 17, 40}) {
    EXPECT_LT((joint_at(live.session, *back, joint) - joint_at(live.session, *open, joint)).norm(),
              1e-6);
  }
}

TEST(LinkageSession, ATargetAtTheEndOfASegmentIsOneAtItsJoint) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto geometry = live.session.geometry();
  const int joint = geometry->joints_of_segment(1, 30);
  ASSERT_GE(joint, 0);
  scene::LinkageTarget target;
  target.segment = 30;
  target.share = 1;
  target.stiffness = 1e7;
  target.position = joint_at(live.session, *opened, joint) + Eigen::Vector3d(0.01, 0, 0);
  const auto pulled = live.edit({PinJoint{0, Held::kMotion}, AddTarget{target}});
  ASSERT_TRUE(pulled);
  EXPECT_EQ(pulled->report.status, EquilibriumStatus::kConverged) << pulled->report.message;
  EXPECT_LT((joint_at(live.session, *pulled, joint) - target.position).norm(), 1e-3);
}

TEST(LinkageSession, ALoneRodHasNoAngles) {
  scene::Linkage linkage;
  linkage.lines.vertices.resize(3, 2);
  linkage.lines.vertices << 0, 1, 0, 0, 0, 0;
  linkage.lines.edges.resize(2, 1);
  linkage.lines.edges << 0, 1;
  LiveSession live(linkage);
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_TRUE(opened->frames->allFinite());
  EXPECT_EQ(opened->mean_angle, 0);
}

TEST(LinkageSession, TheSurfaceIsTheSectionAroundTheRods) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto geometry = live.session.geometry();
  const Eigen::VectorXd surface = live.session.surface(opened->frames->rightCols<1>());
  ASSERT_EQ(surface.size(), 3 * geometry->surface_nodes);
  EXPECT_TRUE(surface.allFinite());
  EXPECT_LT(geometry->surface.maxCoeff(), geometry->surface_nodes);
  // Enclosed volume: section times length, for rods that bend little.
  double volume = 0;
  for (Eigen::Index t = 0; t < geometry->surface.cols(); ++t) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c)
      corners.col(c) = surface.segment<3>(3 * Eigen::Index{geometry->surface(c, t)}).cast<double>();
    volume += corners.determinant() / 6;
  }
  double length = 0;
  Eigen::Index at = 0;
  const Eigen::VectorXd shape = opened->frames->rightCols<1>();
  for (const int edges : geometry->edges) {
    for (int i = 0; i < edges; ++i)
      length += (shape.segment<3>(at + 3 * (i + 1)) - shape.segment<3>(at + 3 * i)).norm();
    at += 6 * Eigen::Index{edges} + 3;
  }
  EXPECT_NEAR(volume, 0.02 * 0.005 * length, 0.02 * volume);
}

}  // namespace
}  // namespace limber::session
