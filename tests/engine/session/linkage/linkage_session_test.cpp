// A linkage that is held in equilibrium while it is edited.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <limits>
#include <mutex>
#include <stdexcept>

#include "engine/base/error.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkage/linkage_mapping.h"
#include "engine/session/linkage/linkage_session.h"
#include "tests/engine/session/harness.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;

constexpr double kDegree = 3.14159265358979323846 / 180;

class LinkageRecorder : public LinkageListener {
 public:
  void on_progress(const Progress&) override {}
  void on_state(State state, const std::string& message) override {
    const std::lock_guard lock(mutex_);
    states_.push_back(state);
    message_ = message;
    changed_.notify_all();
  }
  /// From within the task, at the first shape on the way.
  void cancel_on_the_way(LinkageSession& session) { cancelled_ = &session; }
  void on_result(const std::shared_ptr<const LinkageResult>& result) override {
    if (!result->converged)
      if (LinkageSession* const session = cancelled_.exchange(nullptr)) session->cancel();
    const std::lock_guard lock(mutex_);
    gap_ = gap_ || result->sequence != results_.size() + 1;
    results_.push_back(result);
    changed_.notify_all();
  }

  std::shared_ptr<const LinkageResult> wait_final(Revision revision) {
    std::unique_lock lock(mutex_);
    std::shared_ptr<const LinkageResult> found;
    changed_.wait_for(lock, std::chrono::seconds(60), [&] {
      for (const auto& result : results_)
        if (result->converged && result->revision >= revision) found = result;
      return found != nullptr;
    });
    return found;
  }
  bool wait_state(State state) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60),
                             [&] { return !states_.empty() && states_.back() == state; });
  }
  [[nodiscard]] std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return results_.size();
  }
  [[nodiscard]] bool has_gap() const { return gap_; }
  [[nodiscard]] std::string message() const { return message_; }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<const LinkageResult>> results_;
  std::vector<State> states_;
  std::string message_;
  bool gap_ = false;
  std::atomic<LinkageSession*> cancelled_ = nullptr;
};

struct Live {
  explicit Live(scene::Linkage linkage)
      : session("live", std::move(linkage), {}, pool.executor(), recorder) {}
  std::shared_ptr<LinkageRecorder> recorder = std::make_shared<LinkageRecorder>();
  test::Pool pool{1};
  LinkageSession session;

  std::shared_ptr<const LinkageResult> edit(const std::vector<LinkageEdit>& edits) {
    return recorder->wait_final(session.edit(edits).revision);
  }
};

scene::Linkage hyperboloid() {
  scene::Linkage linkage = scene::make_linkage_sample("hyperboloid");
  linkage.edges_per_segment = 5;
  linkage.conditions = {};  // free
  return linkage;
}

/// Where a joint is: the middle of the edge that its segment begins with.
Eigen::Vector3d joint_at(const LinkageSession& session, const LinkageResult& result, int joint) {
  const auto geometry = session.geometry();
  const Eigen::VectorXf shape = result.frames->rightCols<1>();
  Eigen::Index at = 0;
  for (std::size_t s = 0; s < geometry->edges.size(); ++s) {
    const int edges = geometry->edges[s];
    for (int end = 0; end < 2; ++end) {
      if (geometry->joints_of_segment(end, static_cast<Eigen::Index>(s)) != joint) continue;
      const Eigen::Index first = at + 3 * Eigen::Index{end == 0 ? 0 : edges - 1};
      return (0.5F * (shape.segment<3>(first) + shape.segment<3>(first + 3))).cast<double>();
    }
    at += 6 * Eigen::Index{edges} + 3;
  }
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

TEST(LinkageSession, OpensInEquilibriumAndDeploysStepByStep) {
  Live live(hyperboloid());
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
    Live live(scene::make_linkage_sample(name));
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
Eigen::Vector3d middle(const LinkageSession& session, const Eigen::VectorXf& shape) {
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
  Live live(hyperboloid());  // all joints are equally far from its middle
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
  Live live(hyperboloid());
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
  Live live(hyperboloid());
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

TEST(LinkageSession, WhatCannotBeReachedLeavesTheLastEquilibrium) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  scene::JointLoad load;
  load.joint = 3;
  load.force = {0, 0, 1};  // nothing holds the linkage: it would fly away
  const auto flying = live.edit({SetJointLoad{load}});
  ASSERT_TRUE(flying);
  EXPECT_TRUE(flying->solve_failed);
  EXPECT_NE(flying->report.message.find("asked for: a force of 1 N at joint 3"), std::string::npos)
      << flying->report.message;
  EXPECT_TRUE(flying->frames->allFinite());
  EXPECT_LT((joint_at(live.session, *flying, 40) - joint_at(live.session, *opened, 40)).norm(),
            1e-6);
  const auto held = live.edit({PinJoint{0, Held::kMotion}});
  ASSERT_TRUE(held);
  EXPECT_EQ(held->report.status, EquilibriumStatus::kConverged) << held->report.message;
}

TEST(LinkageSession, UndoBringsTheShapeBackWhateverTheWayWas) {
  // A mechanism: where it goes and comes back to depends on the way.
  scene::Linkage grid = scene::make_linkage_sample("grid");
  grid.edges_per_segment = 4;
  Live live(grid);
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

TEST(LinkageSession, AWayThatEndsShowsHowFarItWent) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto stopped = live.edit({SetMeanAngle{178 * kDegree}});
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(stopped->solve_failed);
  EXPECT_NE(stopped->report.message.find("of the way"), std::string::npos)
      << stopped->report.message;
  EXPECT_NE(stopped->report.message.find("asked for: a mean angle of 178 degrees"),
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
  Live live(dome);
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
  Live live(hyperboloid());
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

TEST(LinkageSession, APinFartherThanRodsReachFromOneThatStaysIsSaid) {
  Live live(hyperboloid());
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
  Live live(drawn);
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

TEST(LinkageSession, ATargetAtTheEndOfASegmentIsOneAtItsJoint) {
  Live live(hyperboloid());
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
  Live live(linkage);
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_TRUE(opened->frames->allFinite());
  EXPECT_EQ(opened->mean_angle, 0);
}

TEST(LinkageSession, APinFarAwayIsReachedInABoundedNumberOfSteps) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const Eigen::Vector3d far(50, 0, 0);
  const auto there = live.edit({PinJoint{0, Held::kMotion, far}});
  ASSERT_TRUE(there);
  EXPECT_LE(static_cast<int>(there->path.size()), 400);
  EXPECT_FALSE(there->solve_failed) << there->report.message;
  EXPECT_LT((joint_at(live.session, *there, 0) - far).norm(), 1e-3);
}

TEST(LinkageSession, AnExecutorThatDropsOrRefusesTasksLosesNothing) {
  const auto recorder = std::make_shared<LinkageRecorder>();
  std::vector<std::function<void()>> kept;
  bool drop = true, refuse = false;
  const Executor executor = [&](std::function<void()> task) {
    if (refuse) throw std::runtime_error("full");
    if (!drop) kept.push_back(std::move(task));
  };
  LinkageSession session("dropped", hyperboloid(), {}, executor, recorder);
  drop = false;
  refuse = true;
  EXPECT_EQ(session.edit({SetMeanAngle{0.3}}).revision, 1u);
  EXPECT_NE(session.state_message().find("full"), std::string::npos);
  refuse = false;
  EXPECT_EQ(session.edit({SetMeanAngle{0.2}}).revision, 2u);
  ASSERT_EQ(kept.size(), 1u);
  kept[0]();
  const auto final = recorder->wait_final(2);
  ASSERT_TRUE(final);
  EXPECT_NEAR(final->mean_angle, 0.2, 1e-6);
  kept.clear();
}

TEST(LinkageSession, APinHoldsWhatTheEditsBeforeItLeadTo) {
  const auto energy = [](bool patient) {
    Live live(hyperboloid());
    const std::vector<std::vector<LinkageEdit>> edits = {{SetMeanAngle{40 * kDegree}},
                                                         {PinJoint{3, Held::kMotion}},
                                                         {PinJoint{70, Held::kMotion}},
                                                         {SetMeanAngle{50 * kDegree}}};
    Revision last = 0;
    for (const auto& edit : edits) {
      last = live.session.edit(edit).revision;
      if (patient && !live.recorder->wait_final(last)) return 0.0;
    }
    const auto final = live.recorder->wait_final(last);
    return final ? final->report.energies.total() : 0;
  };
  const double waiting = energy(true);
  EXPECT_GT(waiting, 0);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(energy(false), waiting, 1e-6 * waiting);
}

TEST(LinkageSession, AStormOfEditsEndsInTheNewest) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  scene::LinkageTarget target;
  target.joint = 80;
  target.position = joint_at(live.session, *opened, 80);
  target.stiffness = 1e4;
  live.session.edit({PinJoint{0, Held::kMotion}, AddTarget{target}});
  Revision last = 0;
  for (int i = 1; i <= 200; ++i) {
    last = live.session.edit({MoveTarget{1, target.position + Eigen::Vector3d(0.0002 * i, 0, 0)}})
               .revision;
  }
  const auto final = live.recorder->wait_final(last);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, EquilibriumStatus::kConverged) << final->report.message;
  EXPECT_EQ(live.session.linkage().conditions.targets.at(0).position.x(),
            target.position.x() + 0.0002 * 200);
  // Pins hold joints where they are: from the same equilibrium, one edit after the other.
  Live slow(hyperboloid());
  ASSERT_TRUE(slow.recorder->wait_final(0));
  ASSERT_TRUE(slow.edit({PinJoint{0, Held::kMotion}, AddTarget{target}}));
  const auto direct = slow.edit({MoveTarget{1, live.session.conditions()->targets[0].position}});
  ASSERT_TRUE(direct);
  EXPECT_NEAR(direct->report.potential(), final->report.potential(),
              1e-6 * std::abs(direct->report.potential()));
  EXPECT_FALSE(live.recorder->has_gap());
}

TEST(LinkageSession, CancellingKeepsTheLastEquilibrium) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  live.recorder->cancel_on_the_way(live.session);
  const Revision revision = live.session.edit({SetMeanAngle{opened->mean_angle + 1.0}}).revision;
  const auto final = live.recorder->wait_final(revision);
  ASSERT_TRUE(final);
  EXPECT_FALSE(final->solve_failed);
  ASSERT_EQ(final->report.status, EquilibriumStatus::kCancelled);
  EXPECT_NEAR(final->mean_angle, opened->mean_angle, 1e-6);
  // And goes on when it is asked again.
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_EQ(undone->report.status, EquilibriumStatus::kConverged);
}

TEST(LinkageSession, ClosingEndsEverything) {
  auto live = std::make_unique<Live>(hyperboloid());
  ASSERT_TRUE(live->recorder->wait_final(0));
  live->session.edit({SetMeanAngle{1.2}});
  live->session.close();
  EXPECT_TRUE(live->recorder->wait_state(State::kClosed));
  EXPECT_THROW(live->session.edit({SetMeanAngle{1.0}}), Error);
  EXPECT_TRUE(live->session.newest_result());
}

TEST(LinkageSession, BadLinkagesAreRefusedWithTheirField) {
  const auto refuse = [](const char* field, const std::function<void(scene::Linkage&)>& spoil) {
    scene::Linkage linkage = hyperboloid();
    spoil(linkage);
    test::Pool pool{1};
    const auto recorder = std::make_shared<LinkageRecorder>();
    try {
      const LinkageSession session("bad", linkage, {}, pool.executor(), recorder);
      // What only the build knows is told by the state.
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
  refuse("youngs_modulus", [](auto& l) { l.youngs_modulus = 0; });
  refuse("edges_per_segment", [](auto& l) { l.edges_per_segment = 2; });
}

TEST(LinkageSession, TheSurfaceIsTheSectionAroundTheRods) {
  Live live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const auto geometry = live.session.geometry();
  const Eigen::VectorXf surface = live.session.surface(opened->frames->rightCols<1>());
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
  const Eigen::VectorXf shape = opened->frames->rightCols<1>();
  for (const int edges : geometry->edges) {
    for (int i = 0; i < edges; ++i)
      length += (shape.segment<3>(at + 3 * (i + 1)) - shape.segment<3>(at + 3 * i)).norm();
    at += 6 * Eigen::Index{edges} + 3;
  }
  EXPECT_NEAR(volume, 0.02 * 0.005 * length, 0.02 * volume);
}

}  // namespace
}  // namespace limber::session
