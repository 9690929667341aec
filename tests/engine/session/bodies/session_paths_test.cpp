// Holds, paths and loops, from the scene to the frames that a client gets.
#include <gtest/gtest.h>

#include "engine/scene/constraint_path.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using scene::End;
using spacetime::SolveStatus;
using test::bar;
using test::held;
using test::kCells;
using test::kInfinity;
using test::kTip;
using test::Live;
using test::tip_at;

constexpr double kSinglePrecision = 2e-6;  // of the bar, whose length is 0.6

scene::Constraint path(double weight) {
  scene::Constraint made = held(12, kTip, {0, 0, 0});
  made.path = {{20, {0, 0.2, 0}}, {30, {0, 0.2, 0}}, {36, {0, 0.1, 0.1}}};
  made.weight = weight;
  return made;
}

scene::Scene still_bar(int frames = 48) { return bar(kCells, frames); }

Eigen::Vector3d moved(const Live& live, const BodyResult& result, int frame) {
  return tip_at(live.session, result, frame) - still_bar().mesh.nodes.col(kTip);
}

double farthest_off(const Live& live, const BodyResult& result, const scene::Constraint& wanted) {
  double off = 0;
  for (int frame = wanted.frame; frame <= wanted.last_frame(); ++frame)
    off = std::max(off, (moved(live, result, frame) - scene::target_in(wanted, frame)).norm());
  return off;
}

TEST(SessionPaths, AnExactOneIsMetInEveryFrame) {
  Live live(still_bar());
  const auto result = live.edit({AddConstraint{path(kInfinity)}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_LT(farthest_off(live, *result, path(kInfinity)), kSinglePrecision);
}

TEST(SessionPaths, ASoftOneIsMetTheBetterTheHeavier) {
  Live live(still_bar());
  double before = 1;
  for (const double weight : {1.0, 100.0, 1e4}) {
    scene::Constraint wanted = path(weight);
    if (weight > 1) wanted.id = 1;
    const auto result =
        weight > 1 ? live.edit({ReplaceConstraint{wanted}}) : live.edit({AddConstraint{wanted}});
    const double off = farthest_off(live, *result, wanted);
    EXPECT_LT(off, 0.9 * before);
    before = off;
  }
  EXPECT_LT(before, 0.01);
}

TEST(SessionPaths, IsMovedRetimedRemovedAndUndoneAsOne) {
  Live live(still_bar());
  const auto first = live.edit({AddConstraint{path(kInfinity)}});
  scene::Constraint there = path(kInfinity);
  scene::move_path(there, {0, -0.1, 0.05});
  const auto shifted = live.edit({MoveConstraint{1, {0, -0.1, 0.05}}});
  EXPECT_LT(farthest_off(live, *shifted, there), kSinglePrecision);
  scene::Constraint later = there;
  later.id = 1;
  later.frame += 5;
  later.path = {{40, {0, 0.1, 0.05}}};  // fewer frames, others, fewer keys
  const auto retimed = live.edit({ReplaceConstraint{later}});
  EXPECT_LT(farthest_off(live, *retimed, later), kSinglePrecision);
  EXPECT_GT((moved(live, *retimed, 12) - there.target).norm(), 1e-3) << "is not held any more";
  EXPECT_EQ(live.session.constraints().size(), 1u);
  const auto removed = live.edit({RemoveConstraint{1}});
  EXPECT_LT(moved(live, *removed, 30).norm(), kSinglePrecision);
  (void)live.edit({Undo{}});
  (void)live.edit({Undo{}});
  const auto back = live.edit({Undo{}});
  ASSERT_EQ(live.session.constraints().size(), 1u);
  EXPECT_EQ(live.session.constraints()[0].path.size(), 3u);
  for (int frame = 0; frame < 48; frame += 3) {
    EXPECT_LT((moved(live, *back, frame) - moved(live, *first, frame)).norm(), 1e-5) << frame;
  }
  const auto gone = live.edit({Undo{}});
  EXPECT_TRUE(live.session.constraints().empty());
  EXPECT_LT(moved(live, *gone, 30).norm(), kSinglePrecision);
}

TEST(SessionPaths, InASceneIsWhatAnEditMakesIt) {
  scene::Scene scene = still_bar();
  scene.constraints = {path(100)};
  Live opened(scene), edited(still_bar());
  const auto one = opened.recorder->wait_final(0);
  const auto other = edited.edit({AddConstraint{path(100)}});
  EXPECT_NEAR(one->report.total_energy, other->report.total_energy,
              1e-6 * one->report.total_energy);
}

TEST(SessionPaths, OutOfReachIsSaidOnce) {
  Live live(still_bar());
  scene::Constraint far = path(100);
  for (auto& key : far.path) key.target = {0, 12, 0};
  const auto result = live.edit({AddConstraint{far}});
  ASSERT_EQ(result->out_of_reach.size(), 1u);
  EXPECT_EQ(result->out_of_reach[0].id, 1u);
  EXPECT_NE(result->report.message.find("Constraint 1 in frame"), std::string::npos)
      << result->report.message;
}

/// Frames later, around the seam, the same motion.
TEST(SessionLoops, DoNotDependOnTheirSeam) {
  constexpr int kTurnFrames = 48, kBy = 29;
  const auto turned = [](int frame) { return (frame + kBy) % kTurnFrames; };
  scene::Scene scene = still_bar(kTurnFrames);
  scene.first_end = scene.last_end = End::kCyclic;
  scene::Scene later = scene;
  for (const auto& [frame, y] : {std::pair{6, 0.2}, {22, -0.15}, {30, 0.0}}) {
    scene.constraints.push_back(held(frame, kTip, {0, y, 0.5 * y}));
    scene.constraints.back().weight = kInfinity;
    later.constraints.push_back(scene.constraints.back());
    later.constraints.back().frame = turned(frame);
  }
  scene::Constraint velocity = held(19, kTip, {0, 0.4, 0});  // later in frame 0
  velocity.kind = scene::TargetKind::kVelocity;
  velocity.weight = kInfinity;
  scene.constraints.push_back(velocity);
  velocity.frame = turned(19);
  ASSERT_EQ(velocity.frame, 0);
  later.constraints.push_back(velocity);
  Live one(scene), other(later);
  const auto first = one.recorder->wait_final(0), second = other.recorder->wait_final(0);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->report.status, SolveStatus::kConverged) << first->report.message;
  double apart = 0;
  for (int frame = 0; frame < kTurnFrames; ++frame) {
    apart = std::max(apart, (one.session.positions(*first, frame, 1) -
                             other.session.positions(*second, turned(frame), 1))
                                .cwiseAbs()
                                .maxCoeff());
  }
  EXPECT_LT(apart, kSinglePrecision);
  const Eigen::Vector3d shown =
      (tip_at(other.session, *second, 1) - tip_at(other.session, *second, kTurnFrames - 1)) * 15;
  EXPECT_LT((shown - velocity.target).norm(), 1e-4);
}

TEST(SessionLoops, AreBegunAndLeftByAnEdit) {
  scene::Scene scene = test::bent_bar();
  scene::Constraint velocity = held(0, kTip, {0, 0.3, 0});
  velocity.kind = scene::TargetKind::kVelocity;
  scene.first_end = scene.last_end = End::kFree;
  scene.constraints.push_back(velocity);
  Live live(scene);
  const auto open = live.recorder->wait_final(0);
  const auto loop = live.edit({SetEnds{End::kCyclic, End::kCyclic}});
  EXPECT_EQ(loop->report.status, SolveStatus::kConverged) << loop->report.message;
  scene.first_end = scene.last_end = End::kCyclic;
  Live cold(scene);
  EXPECT_NEAR(loop->report.total_energy, cold.recorder->wait_final(0)->report.total_energy,
              1e-6 * loop->report.total_energy);
  const auto back = live.edit({SetEnds{End::kFree, End::kFree}});
  EXPECT_NEAR(back->report.total_energy, open->report.total_energy,
              1e-6 * open->report.total_energy);
  EXPECT_THROW(live.session.edit({SetEnds{End::kCyclic, End::kFree}}), Error);
  EXPECT_THROW(live.session.edit({SetEnds{End::kFree, End::kCyclic}}), Error);
}

/// To 1e-6 of the body's length, in the frames that a client gets.
TEST(SessionReach, LeavesTheShownMotionOutsideIt) {
  scene::Scene scene = bar(kCells, 90);
  scene.constraints = {held(10, kTip, {0, 0.1, 0.05}), held(75, kTip, {0, -0.1, 0.02})};
  Live live(scene);
  const auto before = live.recorder->wait_final(0);
  scene::Constraint local = held(45, kTip, {0, 0.12, 0});
  local.weight = kInfinity;
  local.reach = 0.4;  // 12 frames
  const auto after = live.edit({AddConstraint{local}});
  ASSERT_EQ(after->report.status, SolveStatus::kConverged) << after->report.message;
  EXPECT_LT((moved(live, *after, 45) - local.target).norm(), kSinglePrecision);
  double inside = 0;
  for (int frame = 0; frame < 90; ++frame) {
    const double change =
        (live.session.positions(*after, frame, 1) - live.session.positions(*before, frame, 1))
            .cwiseAbs()
            .maxCoeff();
    if (std::abs(frame - 45) > 12) {
      EXPECT_LE(change, 1e-6 * 0.6) << frame;
    } else {
      inside = std::max(inside, change);
    }
  }
  EXPECT_GT(inside, 0.03);
  EXPECT_THROW(live.session.edit({[&] {
    scene::Constraint none = local;
    none.reach = 0;
    return AddConstraint{none};
  }()}),
               Error);
}

TEST(SessionReach, IsInSeconds) {
  const auto changed_frames = [](double rate) {
    scene::Scene scene = bar(kCells, 90);
    scene.dynamics.frames_per_second = rate;
    Live live(scene);
    scene::Constraint local = held(45, kTip, {0, 0.1, 0});
    local.reach = 0.5;
    const auto result = live.edit({AddConstraint{local}});
    int count = 0;
    for (int frame = 0; frame < 90; ++frame)
      count += moved(live, *result, frame).norm() > 1e-7 ? 1 : 0;
    return count;
  };
  EXPECT_NEAR(changed_frames(30), 31, 2);
  EXPECT_NEAR(changed_frames(20), 21, 2);
}

}  // namespace
}  // namespace limber::session
