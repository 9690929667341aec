// Scenes that say in which shape they open.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/condition_path.h"
#include "engine/session/linkages/live_problem.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using scene::Held;
using testing::hyperboloid;
using testing::LiveSession;

/// To where pins without positions and a held angle have other places than the drawing.
std::shared_ptr<const LinkageResult> pin_and_open(LiveSession& live) {
  std::shared_ptr<const LinkageResult> result;
  for (const std::vector<LinkageEdit>& edits : std::vector<std::vector<LinkageEdit>>{
           {SetMeanAngle{40 * kDegree}},
           {PinJoint{3, Held::kMotion}, PinJoint{20, Held::kAngle}},
           {PinJoint{70, Held::kMotion}},
           {SetMeanAngle{48 * kDegree}}})
    result = live.edit(edits);
  return result;
}

void expect_same_energy(const LinkageResult& is, const LinkageResult& was) {
  const double energy = was.report.energies.total();
  EXPECT_NEAR(is.report.energies.total(), energy, 1e-6 * energy);
}

void expect_same_shape(const LinkageResult& is, const LinkageResult& was,
                       float difference = 1e-5F) {
  EXPECT_LT((is.frames->rightCols<1>() - was.frames->rightCols<1>()).cwiseAbs().maxCoeff(),
            difference);
}

TEST(OpenedShape, PinnedScenesOpenInTheShapeTheyHad) {
  LiveSession live(hyperboloid());
  const auto was = pin_and_open(live);
  ASSERT_TRUE(was && !was->solve_failed);
  const scene::Linkage saved = live.session.linkage_in_shape();

  LiveSession again(saved);
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is && !is->solve_failed) << is->report.message;
  EXPECT_EQ(is->report.message.find("opened as drawn"), std::string::npos);
  EXPECT_LE(is->report.iterations, 1) << "it is the equilibrium already";
  expect_same_energy(*is, *was);
  expect_same_shape(*is, *was);
  // And the edits that follow lead to the same shapes.
  const std::vector<LinkageEdit> next = {SetMeanAngle{44 * kDegree}};
  const auto there = live.edit(next), here = again.edit(next);
  ASSERT_TRUE(there && here && !here->solve_failed);
  expect_same_energy(*here, *there);
  expect_same_shape(*here, *there);

  // Without the shape, pins hold the drawing: it is the shape that does it.
  scene::Linkage drawn = saved;
  drawn.shape.reset();
  LiveSession elsewhere(drawn);
  const auto other = elsewhere.recorder->wait_final(0);
  ASSERT_TRUE(other);
  EXPECT_GT(std::abs(other->report.energies.total() / was->report.energies.total() - 1), 0.02);
}

TEST(OpenedShape, LengthsAndSectionsOfTheConditionsAreThere) {
  LiveSession live(hyperboloid());
  const auto opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const int segments = static_cast<int>(live.session.geometry()->edges.size());
  const Eigen::VectorXd drawn = opened->statics->model().segment_lengths();
  Eigen::VectorXd lengths = drawn, scales(segments);
  for (int s = 0; s < segments; ++s) {
    lengths[s] *= 1 + 0.02 * std::sin(3.0 * s);
    scales[s] = 1 + 0.1 * std::cos(2.0 * s);
  }
  ASSERT_TRUE(live.edit({SetMeanAngle{35 * kDegree}}));
  const auto was = live.edit({SetSegmentLengths{lengths}, SetSectionScales{scales}});
  ASSERT_TRUE(was && !was->solve_failed);
  LiveSession again(live.session.linkage_in_shape());
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is && !is->solve_failed) << is->report.message;
  expect_same_energy(*is, *was);
  EXPECT_LE(is->report.iterations, 1);
}

/// Conditions may be changed by hand: the path continues from the shape.
TEST(OpenedShape, OtherAnglesAreGoneToFromTheShape) {
  LiveSession live(hyperboloid());
  const auto was = pin_and_open(live);
  ASSERT_TRUE(was);
  scene::Linkage changed = live.session.linkage_in_shape();
  changed.conditions.mean_angle = 42 * kDegree;
  LiveSession again(changed);
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is && !is->solve_failed) << is->report.message;
  EXPECT_NEAR(is->mean_angle, 42 * kDegree, 1e-9);
  EXPECT_GT(is->path.size(), 1U) << "step by step";
  const auto requested = live.edit({SetMeanAngle{42 * kDegree}});
  ASSERT_TRUE(requested);
  expect_same_energy(*is, *requested);
}

/// An answer that was stored comes back as it was, in every digit that its shape was stored with.
TEST(OpenedShape, AnAnswerThatComesBackIsNotSolvedAgain) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(pin_and_open(live));
  std::shared_ptr<const LinkageResult> was;
  for (const int joint : {40, 12, 61}) {
    scene::JointLoad load;
    load.joint = joint;
    load.force = {0.4, -0.3, 0.05 * joint};
    was = live.edit({SetJointLoad{load}});
  }
  ASSERT_TRUE(was && !was->solve_failed) << was->report.message;
  const scene::Linkage saved = live.session.linkage_in_shape();
  const RecalledAnswer answer{0, was->report.status, false, "as it was"};
  LiveSession again(saved, answer);
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is);
  EXPECT_EQ(is->report.status, was->report.status);
  EXPECT_EQ(is->report.message, "as it was");
  EXPECT_EQ(is->report.iterations, 0);
  EXPECT_NEAR(is->report.potential(), was->report.potential(),
              1e-11 * std::abs(was->report.potential()));
  expect_same_shape(*is, *was, 1e-6F);
  const auto there = live.edit({SetMeanAngle{44 * kDegree}}),
             here = again.edit({SetMeanAngle{44 * kDegree}});
  ASSERT_TRUE(there && here && !here->solve_failed);
  expect_same_energy(*here, *there);

  // What does not balance is no answer, whatever was stored with it.
  scene::Linkage damaged = saved;
  damaged.shape->positions.col(40).z() += 1e-5;
  LiveSession other(damaged, answer);
  const auto found = other.recorder->wait_final(0);
  ASSERT_TRUE(found);
  EXPECT_NE(found->report.message, "as it was");
  // And an answer to another revision is none to this one.
  LiveSession newer(saved, RecalledAnswer{3, was->report.status, false, "as it was"});
  ASSERT_TRUE(newer.recorder->wait_final(0));
  EXPECT_NE(newer.recorder->wait_final(0)->report.message, "as it was");
}

TEST(OpenedShape, AFailedAnswerComesBackWithItsShapeAndReason) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.edit({SetMeanAngle{40 * kDegree}}));
  const auto was = live.edit({SetJointLoad{{5, Eigen::Vector3d(0, 0, 100)}}});
  ASSERT_TRUE(was && was->solve_failed) << "pushed, and nothing holds it";
  LiveSession again(live.session.linkage_in_shape(),
                    RecalledAnswer{0, was->report.status, true, was->report.message});
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is);
  EXPECT_TRUE(is->solve_failed);
  EXPECT_EQ(is->report.status, was->report.status);
  EXPECT_EQ(is->report.message, was->report.message);
  EXPECT_NEAR(is->report.potential(), was->report.potential(),
              1e-9 * std::abs(was->report.potential()));
  expect_same_shape(*is, *was, 1e-6F);
}

/// What failed is tried again from where the session was.
TEST(OpenedShape, AfterAFailedEditTheLastGoodShapeIsThere) {
  LiveSession live(hyperboloid());
  const auto good = live.edit({SetMeanAngle{40 * kDegree}});
  ASSERT_TRUE(good && !good->solve_failed);
  const auto failed = live.edit({SetJointLoad{{5, Eigen::Vector3d(0, 0, 100)}}});
  ASSERT_TRUE(failed && failed->solve_failed) << "pushed, and nothing holds it";
  LiveSession again(live.session.linkage_in_shape());
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is);
  EXPECT_TRUE(is->solve_failed);
  expect_same_energy(*is, *good);
  expect_same_shape(*is, *good);
  const auto freed = again.edit({SetJointLoad{{5}}});
  ASSERT_TRUE(freed && !freed->solve_failed);
  expect_same_energy(*freed, *good);
}

/// Exported before they were solved for, lengths and loads are gone to as live.
TEST(OpenedShape, WhatWasNotSolvedYetIsGoneToFromTheShape) {
  LiveSession live(hyperboloid());
  const auto was = pin_and_open(live);
  ASSERT_TRUE(was);
  scene::Linkage saved = live.session.linkage_in_shape();
  ASSERT_TRUE(saved.shape_conditions);
  Eigen::VectorXd lengths = was->statics->model().segment_lengths();
  for (Eigen::Index s = 0; s < lengths.size(); ++s)
    lengths[s] *= 1 + 0.1 * std::sin(3.0 * static_cast<double>(s));
  saved.conditions.segment_lengths = lengths;
  saved.conditions.loads = {{40, Eigen::Vector3d(0, 0, -20)}};
  LiveSession again(saved);
  const auto is = again.recorder->wait_final(0);
  const auto requested =
      live.edit({SetSegmentLengths{lengths}, SetJointLoad{{40, Eigen::Vector3d(0, 0, -20)}}});
  ASSERT_TRUE(is && requested);
  EXPECT_EQ(is->solve_failed, requested->solve_failed);
  expect_same_shape(*is, *requested, 1e-4F);
}

/// A joint that has gone round twice: its rods lie where they lay, but passed through each other.
TEST(OpenedShape, NearNoEquilibriumItOpensAsDrawnAndSaysSo) {
  LiveSession live(hyperboloid());
  const auto was = live.edit({SetMeanAngle{40 * kDegree}});
  ASSERT_TRUE(was);
  scene::Linkage wound = live.session.linkage_in_shape();
  wound.shape->opening_angles[5] += 4 * std::numbers::pi;
  wound.shape_conditions.reset();
  LiveSession again(wound);
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is && !is->solve_failed) << is->report.message;
  EXPECT_NE(is->report.message.find("opened as drawn"), std::string::npos) << is->report.message;
  EXPECT_NEAR(is->mean_angle, 40 * kDegree, 1e-9);
  expect_same_energy(*is, *was);
}

TEST(OpenedShape, CancelledItBeginsThereAgain) {
  LiveSession live(hyperboloid());
  const auto was = pin_and_open(live);
  ASSERT_TRUE(was);
  LiveLinkage again(live.session.linkage_in_shape());
  const auto conditions = live.session.conditions();
  Cancellation cancelled;
  cancelled.request();
  const auto none = again.solve(conditions, JobContext{cancelled, {}}, [] {});
  EXPECT_EQ(none.report.status, rods::EquilibriumStatus::kCancelled);
  // What is saved now has it still, and what it is in equilibrium under.
  const scene::LinkageConditions own = again.conditions_of_shape();
  EXPECT_EQ(own.pins.size(), conditions->pins.size());
  ASSERT_TRUE(own.mean_angle);
  EXPECT_NEAR(*own.mean_angle, 48 * kDegree, 1e-9);
  const auto outcome = again.solve(conditions, {}, [] {});
  ASSERT_TRUE(outcome.reached) << outcome.report.message;
  EXPECT_NEAR(outcome.report.energies.total(), was->report.energies.total(),
              1e-6 * was->report.energies.total());
}

TEST(OpenedShape, ASceneThatIsSavedBeforeItIsOpenHasItsShapeStill) {
  scene::Linkage saved;
  {
    LiveSession live(hyperboloid());
    ASSERT_TRUE(pin_and_open(live));
    saved = live.session.linkage_in_shape();
  }
  const LinkageSession waiting("waiting", saved, {}, [](std::function<void()>) {}, {});
  const scene::Linkage again = waiting.linkage_in_shape();
  ASSERT_TRUE(again.shape && again.shape_conditions);
  EXPECT_EQ(again.shape->positions, saved.shape->positions);
  EXPECT_EQ(again.shape_conditions->pins.size(), saved.shape_conditions->pins.size());
}

/// Angles are set between -180 and 180 degrees; shapes may have others.
TEST(OpenedShape, AnglesThatNoneCanBeSetToOpenAsDrawn) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.edit({SetMeanAngle{40 * kDegree}}));
  scene::Linkage wound = live.session.linkage_in_shape();
  wound.shape->opening_angles.array() += 4 * std::numbers::pi;
  LiveSession again(wound);
  const auto is = again.recorder->wait_final(0);
  ASSERT_TRUE(is);
  EXPECT_NE(is->report.message.find("opened as drawn"), std::string::npos) << is->report.message;
  const auto next = again.edit({SetMeanAngle{30 * kDegree}});
  ASSERT_TRUE(next && !next->solve_failed) << next->report.message;
}

TEST(OpenedShape, GravityAlongThePathIsThatOfItsRods) {
  scene::Linkage linkage = hyperboloid();
  const MappedLinkage mapped = map_linkage(linkage);
  scene::LinkageConditions heavy;
  heavy.gravity = {0, 0, -9.81};
  const rods::LinkageState state(mapped.model);
  const rods::detail::ConditionPath path(state, map_conditions(heavy, mapped, 1),
                                         map_conditions(heavy, mapped, 1), {});
  EXPECT_LT((scene_conditions(path.at(0.5), mapped, 1).gravity - heavy.gravity).norm(), 1e-12);
  linkage.density = 0;
  EXPECT_EQ(scene_conditions(path.at(0.5), map_linkage(linkage), 1).gravity,
            Eigen::Vector3d::Zero());
}

TEST(OpenedShape, ConditionsAlongThePathAreThoseOfAScene) {
  const MappedLinkage mapped = map_linkage(hyperboloid());
  constexpr double kUnit = 0.001;
  scene::LinkageConditions conditions;
  conditions.pins = {{3, Held::kMotion, Eigen::Vector3d(1, 2, 3)}, {4, Held::kAngle, {}}};
  conditions.angles = {{5, 0.25}};
  conditions.mean_angle = 0.5;
  conditions.targets = {{0, 2, -1, 0.5, {4, 5, 6}, 10}, {0, -1, 6, 0.25, {7, 8, 9}, 11}};
  conditions.loads = {{1, {1, 2, 3}, {4, 5, 6}, 7}};
  conditions.gravity = {0, 0, -9.81};
  rods::Conditions path = map_conditions(conditions, mapped, kUnit);
  path.loads.push_back(path.loads[0]);
  path.springs.push_back({rods::JointPoint{7}, Eigen::Vector3d::Zero(), 0});
  const scene::LinkageConditions back = scene_conditions(path, mapped, kUnit);
  ASSERT_EQ(back.pins.size(), 2U);
  EXPECT_EQ(back.pins[0].held, Held::kMotion);
  EXPECT_EQ(back.pins[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(back.pins[1].held, Held::kAngle);
  EXPECT_FALSE(back.pins[1].position);
  EXPECT_EQ(back.angles[0].angle, 0.25);
  EXPECT_EQ(back.mean_angle, 0.5);
  ASSERT_EQ(back.targets.size(), 2U) << "one has faded";
  EXPECT_EQ(back.targets[0].joint, 2);
  EXPECT_NEAR(back.targets[0].stiffness, 10, 1e-12);
  EXPECT_EQ(back.targets[1].segment, 6);
  EXPECT_NEAR(back.targets[1].share, 0.25, 1e-12);
  EXPECT_NEAR(back.targets[1].stiffness, 11, 1e-12);
  ASSERT_EQ(back.loads.size(), 1U);
  EXPECT_LT((back.loads[0].force - Eigen::Vector3d(2, 4, 6)).norm(), 1e-12);
  EXPECT_LT((back.loads[0].moment - Eigen::Vector3d(8, 10, 12)).norm(), 1e-12);
  EXPECT_NEAR(back.loads[0].torque, 14, 1e-12);
  EXPECT_EQ(back.gravity, conditions.gravity);
}

TEST(OpenedShape, AShapeFarAwayIsRefused) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::Linkage far = live.session.linkage_in_shape();
  far.shape->positions.array() += 1e8;
  far.shape->vertices.array() += 1e8;
  const LinkageCheck check = check_linkage(far);
  ASSERT_FALSE(check.issues.empty());
  EXPECT_EQ(check.issues[0].field, "shape.positions");
}

TEST(OpenedShape, AShapeOfAnotherLinkageIsRefusedByName) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::Linkage finer = live.session.linkage_in_shape();
  finer.edges_per_segment = 6;
  const LinkageCheck check = check_linkage(finer);
  ASSERT_EQ(check.issues.size(), 1U);
  EXPECT_EQ(check.issues[0].field, "shape.vertices");
  EXPECT_NE(check.issues[0].message.find("leave the shape out"), std::string::npos)
      << check.issues[0].message;
}

}  // namespace
}  // namespace limber::session
