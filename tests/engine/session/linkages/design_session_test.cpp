// Designs of a live linkage: begun, watched, changed, paused, stopped, taken, undone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "engine/scene/samples/linkage_samples.h"
#include "tests/engine/session/linkages/live_designs.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using namespace limber::session::testing;

TEST(DesignSession, FindsAKnownTargetAndKeepsItsLengths) {
  LiveDesignSession live;
  const auto before = live.watcher->wait_final(0);
  live.session.start_design(request(), 7);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->end == DesignEnd::kConverged || end->end == DesignEnd::kSettled)
      << static_cast<int>(end->end) << " " << end->message;
  EXPECT_EQ(end->tag, 7U);
  EXPECT_TRUE(end->best.holds);
  EXPECT_LT(end->best.target_rms, end->start.target_rms / 20);
  ASSERT_TRUE(end->taken);
  EXPECT_EQ(*end->taken, 1U);
  const auto shape = live.watcher->wait_final(1);
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed);
  const Eigen::Matrix3Xd joints = live.joints(*shape);
  double sum = 0;
  const auto wanted = request().goal.targets;
  for (const auto& target : wanted)
    sum += (joints.col(target.joint) - target.position).squaredNorm();
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(wanted.size())), end->best.target_rms, 1e-3);
  EXPECT_EQ(live.lengths().size(), 40);
  EXPECT_EQ(live.session.linkage().conditions.segment_lengths, live.lengths());

  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_EQ(live.lengths().size(), 0);
  EXPECT_EQ(live.joints(*undone), live.joints(*before)) << "the very answer";
  const auto redone = live.edit({Redo{}});
  EXPECT_EQ(live.joints(*redone), joints);
}

TEST(DesignSession, StepsAreFramesOfTheFlatAndTheDeployedShape) {
  LiveDesignSession live;
  live.session.start_design(request());
  ASSERT_TRUE(live.watcher->wait_end());
  int steps = 0;
  double last = std::numeric_limits<double>::infinity();
  for (const auto& result : live.watcher->results()) {
    if (!result->design) continue;
    ++steps;
    EXPECT_FALSE(result->is_final);
    ASSERT_EQ(result->frames->cols(), 2);
    EXPECT_TRUE(result->frames->allFinite());
    EXPECT_LE(result->design->now.objective, last * (1 + 1e-6));
    last = result->design->now.objective;
    const Eigen::Matrix3Xd deployed = live.joints(*result);
    double sum = 0;
    const auto targets = request().goal.targets;
    for (const auto& target : targets)
      sum += (deployed.col(target.joint) - target.position).squaredNorm();
    EXPECT_NEAR(std::sqrt(sum / static_cast<double>(targets.size())),
                result->design->now.target_rms, 1e-4);
    // The flat one is not opened.
    EXPECT_GT((live.session.shape()->joints(result->frames->col(0)) - deployed).norm(), 10);
  }
  EXPECT_GT(steps, 5);
}

TEST(DesignSession, PausesChangesStopsAndIsTakenLater) {
  LiveDesignSession live;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 3 && info.state == DesignState::kRunning) live.session.pause_design();
  };
  live.session.start_design(request());
  const auto paused = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.state == DesignState::kPaused; });
  ASSERT_TRUE(paused);
  EXPECT_EQ(paused->iteration, 3);
  live.watcher->hook = {};
  // Every other edit waits for the end of the design.
  EXPECT_THROW(live.session.edit({SetMeanAngle{0.9}}), Error);
  EXPECT_THROW(live.session.start_design(request()), Error);
  EXPECT_EQ(live.session.design()->state, DesignState::kPaused);

  DesignChange change;
  change.distance_weight = 1e3;
  live.session.change_design(change);
  const auto changed = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.goal.distance_weight == 1e3; });
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->state, DesignState::kPaused);
  EXPECT_LT(changed->now.objective, paused->now.objective);
  EXPECT_EQ(changed->now.target_rms, paused->now.target_rms);

  live.session.resume_design();
  ASSERT_TRUE(live.watcher->wait_design([](const DesignInfo& info) {
    return info.iteration > 3 && info.state == DesignState::kRunning;
  }));
  live.session.stop_design();
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kStopped);
  EXPECT_FALSE(end->taken);
  EXPECT_EQ(live.session.revision(), 0U);
  EXPECT_EQ(live.lengths().size(), 0);
  EXPECT_THROW(live.session.stop_design(), Error);

  const EditReceipt taken = live.session.take_design();
  EXPECT_EQ(taken.revision, 1U);
  const auto shape = live.watcher->wait_final(1);
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed) << shape->report.message;
  EXPECT_EQ(live.lengths(), live.session.best_design()->sizes.segments);
  EXPECT_EQ(live.session.design()->taken, 1U);
}

TEST(DesignSession, TakenAgainItIsTheRevisionThatTookIt) {
  LiveDesignSession live;
  DesignRequest design = request();
  design.max_iterations = 5;
  live.session.start_design(design);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  if (!end->taken) {
    EXPECT_EQ(live.session.take_design().revision, 1U);
  }
  EXPECT_EQ(live.session.take_design().revision, 1U);
  EXPECT_EQ(live.session.take_design(Revision{1}).revision, 1U);
  EXPECT_EQ(refused_field([&] { live.session.take_design(Revision{0}); }), "expected_revision");
  EXPECT_EQ(live.session.revision(), 1U);
  live.edit({Undo{}});
  EXPECT_EQ(live.lengths().size(), 0) << "one step of undo";
  EXPECT_EQ(live.session.take_design().revision, 3U) << "after undo it is an edit again";
  EXPECT_EQ(live.lengths(), live.session.best_design()->sizes.segments);
}

/// The flat sample opens without effort, and its flat shape is held where it lies.
TEST(DesignSession, AMechanismReachesWhatItCanReach) {
  LiveDesignSession live(scene::make_linkage_sample("grid"));
  const auto opened = live.edit({SetMeanAngle{0.9}});
  ASSERT_FALSE(opened->solve_failed) << opened->report.message;
  const Eigen::Matrix3Xd joints = live.joints(*opened);
  const Eigen::Vector3d middle = joints.rowwise().mean();
  DesignRequest design;
  for (int j = 0; j < joints.cols(); ++j)
    design.goal.targets.push_back({j, middle + 1.03 * (joints.col(j) - middle), 1});
  design.max_iterations = 40;
  live.session.start_design(design);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_GT(end->start.target_rms, 0.01);
  EXPECT_LT(end->best.target_rms, 1e-4) << end->message;
  EXPECT_TRUE(end->best.holds);
}

TEST(DesignSession, TheFlatShapeIsHeldAtARequestedAngle) {
  LiveDesignSession live;
  live.session.start_design(request());
  ASSERT_TRUE(live.watcher->wait_end());
  EXPECT_FALSE(live.session.design()->flat_angle) << "nothing holds it";
  const double free = live.session.best_design()->flat.mean_opening_angle();
  live.edit({Undo{}});
  live.watcher->forget();
  DesignRequest design = request();
  design.flat_angle = free - 0.15;
  live.session.start_design(design);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->flat_angle, design.flat_angle);
  EXPECT_TRUE(end->best.holds) << end->message;
  EXPECT_LT(end->best.target_rms, end->start.target_rms / 20) << end->message;
  EXPECT_NEAR(live.session.best_design()->flat.mean_opening_angle(), *design.flat_angle, 1e-9);
  EXPECT_TRUE(end->other_optima.empty()) << "the other one was requested for something else";
}

/// A dome, whose flat shape rises: what it is to rise by is beyond all measure, and hides nothing.
TEST(DesignSession, AFlatHeightOfNothingDoesNotMakeGradientsLookSmall) {
  LiveDesignSession live(scene::make_linkage_sample("dome"));
  const auto opened = live.edit({SetMeanAngle{1.047}});
  const Eigen::Matrix3Xd joints = live.joints(*opened);
  DesignRequest design;
  const Eigen::Vector3d middle = joints.rowwise().mean();
  for (int j = 0; j < joints.cols(); ++j) {
    const Eigen::Vector3d away = joints.col(j) - middle;
    design.goal.targets.push_back(
        {j, middle + Eigen::Vector3d(away.x(), away.y(), 1.3 * away.z())});
  }
  design.max_iterations = 30;
  for (const double height : {1e-9, 1e-3}) {
    design.flat_height = height;
    live.watcher->forget();
    live.session.start_design(design);
    const auto end = live.watcher->wait_end();
    ASSERT_TRUE(end);
    EXPECT_EQ(end->end, DesignEnd::kIterationLimit) << end->message;
    const auto infos = live.watcher->infos();
    EXPECT_TRUE(std::any_of(infos.begin(), infos.end(), [](const auto& info) {
      return info->message == "finding the erection" && info->state == DesignState::kRunning;
    })) << "the last stage is reported";
    EXPECT_NE(end->message, "finding the erection");
    if (end->taken) live.edit({Undo{}});
  }
}

TEST(DesignSession, AnAngleThatTheLinkageDoesNotCloseToIsNamed) {
  LiveDesignSession live(scene::make_linkage_sample("dome"));
  const auto opened = live.edit({SetMeanAngle{1.0}});
  const Eigen::Matrix3Xd before = live.joints(*opened);
  DesignRequest design;
  design.goal.targets = {{3, before.col(3) + Eigen::Vector3d(0, 0, 0.01), 1}};
  design.flat_angle = -170 * 3.14159265358979323846 / 180;
  live.session.start_design(design);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kFailed);
  EXPECT_EQ(end->fault_field, "flat_angle");
  EXPECT_EQ(end->fault, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(end->message.find("the linkage does not go to a mean angle of -170 degrees"), 0U)
      << end->message;
  EXPECT_FALSE(end->taken);
  EXPECT_EQ(live.joints(*live.watcher->wait_final(opened->revision)), before);
}

TEST(DesignSession, TakenWhileItRunsItEnds) {
  LiveDesignSession live;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 4 && info.state == DesignState::kRunning && !info.taken) {
      EXPECT_EQ(live.session.take_design().revision, 1U);
    }
  };
  live.session.start_design(request());
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kStopped);
  EXPECT_EQ(end->taken, 1U);
  EXPECT_EQ(end->iteration, 4);
  ASSERT_TRUE(live.watcher->wait_final(1));
  EXPECT_EQ(live.session.revision(), 1U);
  EXPECT_EQ(live.lengths().size(), 40);
}

TEST(DesignSession, CancelStopsAndCloseEndsOneThatIsPaused) {
  LiveDesignSession live;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 2 && info.state == DesignState::kRunning) live.session.pause_design();
  };
  const auto is_paused = [](const DesignInfo& info) { return info.state == DesignState::kPaused; };
  live.session.start_design(request());
  ASSERT_TRUE(live.watcher->wait_design(is_paused));
  live.session.cancel();
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kStopped);
  const auto shape = live.edit({SetMeanAngle{0.95}});
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed);

  live.watcher->forget();
  live.session.start_design(request());
  ASSERT_TRUE(live.watcher->wait_design(is_paused));
  live.session.close();
  EXPECT_EQ(live.session.state(), State::kClosed);
}

TEST(DesignSession, BadGoalsAreRefusedAndTheRunningDesignIsIntact) {
  LiveDesignSession live;
  const auto start = [&](const std::function<void(DesignRequest&)>& spoil) {
    DesignRequest bad = request();
    spoil(bad);
    return refused_field([&] { live.session.start_design(bad); });
  };
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.targets.clear(); }), "goal.targets");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.distance_weight = -1; }),
            "goal.distance_weight");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.flat_share = 1.5; }), "goal.flat_share");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.targets[2].joint = 25; }),
            "goal.targets[2].joint");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.targets[2].joint = 1; }),
            "goal.targets[2].joint");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.targets[3].weight = -1; }),
            "goal.targets[3].weight");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.goal.targets[0].position.x() = 1e6; }),
            "goal.targets[0].position");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.shortest = 1.01; }), "shortest");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.longest = 0.99; }), "longest");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.smallest_angle = 4; }), "smallest_angle");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.flat_angle = -3.2; }), "flat_angle");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.flat_angle = std::nan(""); }), "flat_angle");
  EXPECT_FALSE(live.session.design());

  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 2 && info.state == DesignState::kRunning) live.session.pause_design();
  };
  live.session.start_design(request());
  ASSERT_TRUE(live.watcher->wait_design(
      [](const DesignInfo& info) { return info.state == DesignState::kPaused; }));
  DesignChange far, negative;
  far.targets = request().goal.targets;
  (*far.targets)[1].position.z() = -1e7;
  negative.surface_weight = -2;
  EXPECT_EQ(refused_field([&] { live.session.change_design(far); }), "targets[1].position");
  EXPECT_EQ(refused_field([&] { live.session.change_design(negative); }), "surface_weight");
  live.watcher->hook = {};
  live.session.resume_design();
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->taken) << end->message;
  EXPECT_LT(end->best.target_rms, end->start.target_rms / 20);
}

TEST(DesignSession, ALinkageWithoutJointsIsNotDesigned) {
  scene::Linkage rods = scene::make_linkage_sample("grid");
  rods.conditions = {};
  rods.lines.vertices.resize(3, 4);
  rods.lines.vertices << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  rods.lines.edges.resize(2, 2);
  rods.lines.edges << 0, 2, 1, 3;
  testing::LiveSession live(rods);
  ASSERT_TRUE(live.recorder->wait_final(0));
  DesignRequest any = request();
  EXPECT_EQ(refused_field([&] { live.session.start_design(any); }), "");
  any.goal.targets.clear();
  EXPECT_EQ(refused_field([&] { live.session.start_design(any); }), "");
}

TEST(DesignSession, WhatDerivativesAreNotKnownUnderIsRefusedByName) {
  LiveDesignSession live;
  live.edit({SetGravity{{0, 0, -9.81}}});
  EXPECT_EQ(refused_field([&] { live.session.start_design(request()); }), "gravity");
  scene::JointLoad load;
  load.joint = 3;
  load.torque = 1;
  live.edit({Undo{}, SetJointLoad{load}});
  EXPECT_EQ(refused_field([&] { live.session.start_design(request()); }), "loads");
  scene::LinkageTarget spring;
  spring.joint = 3;
  spring.stiffness = 10;
  live.edit({Undo{}, AddTarget{spring}});
  EXPECT_EQ(refused_field([&] { live.session.start_design(request()); }), "targets");
}

TEST(DesignSession, ALinkageOutOfBalanceIsNotDesigned) {
  LiveDesignSession live;
  // Opened between corners that stay where they are it has nowhere to go.
  std::vector<LinkageEdit> edits;
  for (const int corner : {0, 4, 20, 24})
    edits.emplace_back(PinJoint{corner, scene::Held::kMotion});
  ASSERT_TRUE(live.edit(edits));
  const auto stopped = live.edit({SetMeanAngle{2.5}});
  ASSERT_TRUE(stopped);
  ASSERT_TRUE(stopped->solve_failed);
  live.session.start_design(request());
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kFailed);
  EXPECT_NE(end->message.find("equilibrium"), std::string::npos) << end->message;
  EXPECT_THROW(live.session.take_design(), Error);
}

TEST(DesignSession, DesignsAreLongTasks) {
  std::deque<std::function<void()>> tasks;
  std::vector<Urgency> posted;
  const Executor executor = [&](Executor::Task task, Urgency urgency) {
    tasks.push_back(std::move(task));
    posted.push_back(urgency);
  };
  const auto run_all = [&] {
    for (; !tasks.empty(); tasks.pop_front()) tasks.front()();
  };
  LinkageSession session("long", curved_grid(), {}, executor, std::make_shared<Watcher>());
  run_all();
  EXPECT_EQ(std::count(posted.begin(), posted.end(), Urgency::kLong), 0);
  session.start_design(request());
  EXPECT_EQ(posted.back(), Urgency::kLong) << "so that checks of other sessions keep a place";
  session.stop_design();
  run_all();
  EXPECT_EQ(session.design()->state, DesignState::kEnded);
}

TEST(DesignSession, LengthsAreEditsThatTheShapeFollows) {
  LiveDesignSession live;
  Eigen::VectorXd lengths = Eigen::VectorXd::Constant(40, 40);
  EXPECT_EQ(refused_field([&] { live.session.edit({SetSegmentLengths{lengths.head(3)}}); }),
            "edits[0].segment_lengths");
  lengths[5] = 4000;
  EXPECT_EQ(refused_field([&] { live.session.edit({SetSegmentLengths{lengths}}); }),
            "edits[0].segment_lengths[5]");
  lengths[5] = 41;
  const auto shape = live.edit({SetSegmentLengths{lengths}});
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed) << shape->report.message;
  const LinkageDetail detail =
      shape->statics->detail(shape->frames->rightCols<1>(), shape->strains->rightCols<1>());
  EXPECT_NEAR(detail.segments[5].rest_length, 41, 1e-9);
  EXPECT_NEAR(detail.segments[6].rest_length, 40, 1e-9);
  // A session opened with them has the same shape.
  LiveDesignSession other(live.session.linkage());
  const auto opened = other.watcher->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_NEAR(opened->report.energies.total(), shape->report.energies.total(),
              1e-5 * shape->report.energies.total());
}

}  // namespace
}  // namespace limber::session
