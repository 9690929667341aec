// Keyframes through a session (space-time editing, section 6.2).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::bent_bar;
using test::held;
using test::kCells;
using test::kInfinity;
using test::kTip;
using test::Live;

constexpr double kLength = 0.1 * kCells;
/// Of what the reduced model makes of the modal coordinates of one of its own poses.
constexpr double kModelError = 1.5e-3 * kLength;

/// What a motion of the bar does in a frame, as a keyframe of any frame.
scene::Keyframe taken(const BodySession& session, const BodyResult& result, int from, int frame) {
  scene::Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.pose = std::make_shared<const Eigen::VectorXd>(
      session.positions(result, from, 1).col(0) - session.unedited()->mesh.nodes.reshaped());
  return keyframe;
}

double distance(const BodySession& session, const BodyResult& result,
                const scene::Keyframe& keyframe) {
  const Eigen::VectorXd miss = session.positions(result, keyframe.frame, 1).col(0) -
                               session.unedited()->mesh.nodes.reshaped() - *keyframe.pose;
  return miss.reshaped(3, miss.size() / 3).colwise().norm().maxCoeff();
}

TEST(SessionKeyframes, PosesOfASolvedMotionAreMet) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->max_keyframe_error, 0);
  Live live(test::bar(kCells, 30));
  ASSERT_TRUE(live.recorder->wait_final(0));
  std::vector<scene::Keyframe> keyframes = {taken(source.session, *motion, 10, 8),
                                            taken(source.session, *motion, 20, 21)};
  for (auto& keyframe : keyframes) keyframe.weight = kInfinity;
  const auto final = live.edit({AddKeyframe{keyframes[0]}, AddKeyframe{keyframes[1]}});
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_LT(final->max_keyframe_error, kModelError);
  double most = 0;
  for (const auto& keyframe : keyframes)
    most = std::max(most, distance(live.session, *final, keyframe));
  EXPECT_GT(most, 0);
  EXPECT_NEAR(final->max_keyframe_error, most, 1e-6);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionKeyframes, OverAMovingBaseMotion) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  scene::Scene scene = test::bar(kCells, 30);
  const Eigen::MatrixXd positions = source.session.positions(*motion, 0, 30);
  scene.base_motion = positions.colwise() - positions.col(0);
  scene.keyframes = {taken(source.session, *motion, 20, 10)};  // elsewhere than the base has it
  scene.keyframes[0].weight = kInfinity;
  Live live(scene);
  auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_LT(final->max_keyframe_error, kModelError);
  EXPECT_GT(final->report.force_energy, 1e-6);
  // Where the base motion is already, nothing needs to be done.
  final = live.edit({RemoveKeyframe{1}, AddKeyframe{taken(source.session, *motion, 10, 10)}});
  EXPECT_LT(final->report.total_energy, 1e-6);
  EXPECT_LT(final->max_keyframe_error, kModelError);
}

TEST(SessionKeyframes, MixWithPositionsAndMaterials) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  scene::Scene scene = test::bar(kCells, 30);
  scene.model.mode_count = 6;
  scene.model.candidate_modes = 12;
  scene.keyframes = {taken(source.session, *motion, 10, 8)};
  scene.constraints = {held(20, kTip, {0, -0.1, 0})};
  Live live(scene);
  const auto plain = live.recorder->wait_final(0);
  ASSERT_TRUE(plain);
  const auto fitted = live.edit({SetMaterialVariables{scene::MaterialVariables::kAll}});
  ASSERT_TRUE(fitted);
  EXPECT_GT(fitted->material_iterations, 0);
  EXPECT_LT(fitted->report.total_energy, plain->report.total_energy);
  EXPECT_LT(fitted->max_keyframe_error, 0.02 * kLength);
  EXPECT_LT(fitted->report.max_constraint_error, 0.02 * kLength);
}

TEST(SessionKeyframes, UndoAndRedoBringBackTheMotions) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  Live live(bent_bar());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto keyed = live.edit({AddKeyframe{taken(source.session, *motion, 20, 15)}});
  const auto moved = live.edit({MoveKeyframe{1, 13, 500.0}});
  EXPECT_GT((keyed->modal - first->modal).norm(), 1e-3);
  EXPECT_GT((moved->modal - keyed->modal).norm(), 1e-3);
  const auto near = [](const BodyResult& a, const BodyResult& b) {
    EXPECT_LT((a.modal - b.modal).norm(), 1e-6 * b.modal.norm());
    EXPECT_NEAR(a.report.total_energy, b.report.total_energy, 1e-8 * b.report.total_energy);
  };
  near(*live.edit({Undo{}}), *keyed);
  near(*live.edit({Undo{}}), *first);
  near(*live.edit({Redo{}}), *keyed);
  ASSERT_EQ(live.session.keyframes().size(), 1u);
  EXPECT_EQ(live.session.scene().keyframes.at(0).frame, 15);
  near(*test::solve_fresh(live.session.scene(), test::shared_cache()), *keyed);
}

TEST(SessionKeyframes, APoseInsideOutHarmsNobody) {
  Live live(bent_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::Keyframe flat;  // all nodes in one point
  flat.frame = 15;
  flat.pose =
      std::make_shared<const Eigen::VectorXd>(-live.session.unedited()->mesh.nodes.reshaped());
  const auto odd = live.edit({AddKeyframe{flat}});
  ASSERT_TRUE(odd);
  EXPECT_TRUE(odd->modal.allFinite());
  if (odd->solve_failed) {
    EXPECT_THAT(odd->report.message, ::testing::HasSubstr("keyframe 1 in frame 15"));
  }
  const auto after = live.edit({RemoveKeyframe{1}});
  ASSERT_TRUE(after);
  EXPECT_FALSE(after->solve_failed);
  EXPECT_EQ(after->report.status, SolveStatus::kConverged);
  EXPECT_EQ(live.recorder->fault(), "");
}

/// A bar's sections turned about its axis in proportion to x, by `angle` [rad] at the far end.
scene::Keyframe twisted(const scene::Scene& bar, int frame, double angle) {
  const Eigen::Matrix3Xd& rest = bar.mesh.nodes;
  const Eigen::Vector3d middle(0, 0.5 * rest.row(1).maxCoeff(), 0.5 * rest.row(2).maxCoeff());
  Eigen::Matrix3Xd pose = rest;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const Eigen::AngleAxisd turn(angle * rest(0, i) / rest.row(0).maxCoeff(),
                                 Eigen::Vector3d::UnitX());
    pose.col(i) = middle + turn * (rest.col(i) - middle);
  }
  scene::Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.pose = std::make_shared<const Eigen::VectorXd>((pose - rest).reshaped());
  keyframe.weight = kInfinity;
  return keyframe;
}

/// By how much the far end of a bar is turned about its axis [rad], next to a turn that is known.
double turn_of_end(const scene::Scene& bar, const Eigen::VectorXd& positions, int cells,
                   double near) {
  const auto across = [&](const Eigen::Matrix3Xd& nodes) {
    return Eigen::Vector3d(nodes.col(test::bar_node(cells, cells, 1, 2)) -
                           nodes.col(test::bar_node(cells, cells, 0, 0)));
  };
  const Eigen::Vector3d was = across(bar.mesh.nodes),
                        is = across(positions.reshaped(3, positions.size() / 3));
  const double turn =
      std::atan2(was.y() * is.z() - was.z() * is.y(), was.y() * is.y() + was.z() * is.z());
  return near + std::remainder(turn - near, 2 * M_PI);
}

TEST(SessionKeyframes, ASequenceWithHalfTurnAndFullTurnTwists) {
  constexpr int kLong = 12;
  scene::Scene scene = test::bar(kLong, 60);
  scene.model.mode_count = 24;
  scene.model.basis_size = 100;
  scene.dynamics.period_frames = 600;  // else torsion goes round within a few frames
  const double angles[] = {0.5 * M_PI, M_PI, 1.5 * M_PI, 2 * M_PI};
  for (int k = 0; k < 4; ++k)
    scene.keyframes.push_back(twisted(scene, 12 * (k + 1) - 1, angles[k]));
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(live.recorder->fault(), "");
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  const Eigen::MatrixXd motion = live.session.positions(*final, 0, 60);
  ASSERT_TRUE(motion.allFinite());
  double turn = 0;
  std::vector<double> turns;
  for (int frame = 0; frame < 60; ++frame)
    turns.push_back(turn = turn_of_end(scene, motion.col(frame), kLong, turn));
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(turns[static_cast<std::size_t>(12 * (k + 1) - 1)], angles[k], 0.01) << k;
  for (const auto& keyframe : scene.keyframes)
    EXPECT_LT(distance(live.session, *final, keyframe), scene.model.tolerance * kLong * 0.1);
}

// Linear modes have no exact torsion: without what they leave of the poses these are missed by 2 to
// 40 % of the bar.
TEST(SessionKeyframes, ExactKeyframesOfTwistsOf90To540DegreesAreMet) {
  for (const double turns : {0.25, 0.5, 1.0, 1.5}) {
    scene::Scene scene = test::bar(12, 60);
    scene.dynamics.period_frames = 600;
    scene.keyframes.push_back(twisted(scene, 40, 2 * M_PI * turns));
    Live live(scene);
    const auto final = live.recorder->wait_final(0);
    ASSERT_TRUE(final);
    EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
    EXPECT_LT(final->max_keyframe_error, scene.model.tolerance * 1.2) << turns;
    EXPECT_NEAR(distance(live.session, *final, scene.keyframes[0]), final->max_keyframe_error,
                1e-6);
    double turn = 0;
    const Eigen::MatrixXd motion = live.session.positions(*final, 0, 60);
    for (int frame = 0; frame <= 40; ++frame)
      turn = turn_of_end(scene, motion.col(frame), 12, turn);
    EXPECT_NEAR(turn, 2 * M_PI * turns, 0.02) << "also turned in between";
    // It is moved and taken away as one.
    EXPECT_LT(live.edit({MoveKeyframe{1, 30, {}}})->max_keyframe_error,
              scene.model.tolerance * 1.2);
    EXPECT_LT(live.edit({RemoveKeyframe{1}})->report.total_energy, 1e-12);
    EXPECT_EQ(live.recorder->fault(), "");
  }
}

TEST(SessionKeyframes, ATwistFollowsEditsOfEndsAndDynamicsAndUndo) {
  scene::Scene scene = test::bar(12, 60);
  scene.dynamics.period_frames = 600;
  scene.keyframes = {twisted(scene, 25, M_PI), twisted(scene, 31, -0.5 * M_PI)};
  Live live(scene);
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const double tolerance = scene.model.tolerance * 1.2;
  EXPECT_LT(first->max_keyframe_error, tolerance);
  scene::DynamicsRequest lively;
  lively.damping_ratio = 0.05;
  lively.period_frames = 300;
  const auto other = live.edit({SetDynamics{lively}});
  EXPECT_LT(other->max_keyframe_error, tolerance);
  EXPECT_GT((other->modal - first->modal).norm(), 1e-3 * first->modal.norm());
  EXPECT_LT(live.edit({SetEnds{scene::End::kCyclic, scene::End::kCyclic}})->max_keyframe_error,
            tolerance);
  ASSERT_TRUE(live.edit({Undo{}}));
  const auto again = live.edit({Undo{}});
  EXPECT_LT((again->modal - first->modal).norm(), 1e-6 * first->modal.norm());
  EXPECT_LT((live.session.positions(*again, 0, 60) - live.session.positions(*first, 0, 60))
                .cwiseAbs()
                .maxCoeff(),
            1e-3 * 1.2);
  // A soft one has a part of its pose.
  const auto soft = live.edit({MoveKeyframe{1, {}, 1e-5}});
  EXPECT_GT(soft->max_keyframe_error, tolerance);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionKeyframes, ATargetBesideATwistIsMetInShownFrames) {
  scene::Scene scene = test::bar(12, 60);
  scene.dynamics.period_frames = 600;
  scene.keyframes.push_back(twisted(scene, 40, M_PI));
  auto target = held(30, test::bar_node(12, 12, 1, 1), {0, 0.1, 0});
  target.weight = kInfinity;
  scene.constraints = {target};
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_LT(final->max_keyframe_error, scene.model.tolerance * 1.2);
  const Eigen::VectorXd shown = live.session.positions(*final, 30, 1).col(0);
  const int node = test::bar_node(12, 12, 1, 1);
  const Eigen::Vector3d moved = shown.segment<3>(3 * node) - scene.mesh.nodes.col(node);
  EXPECT_LT((moved - target.target).norm(), 1e-4 * 1.2);
}

TEST(SessionKeyframes, AFreeBodyIsMovedAndTurned) {
  scene::Scene scene = test::bar(kCells, 40);
  scene.fixed_nodes.clear();
  scene.model.mode_count = 8;
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -1).normalized(), shift(0.3, -0.2, 0.5);
  for (int k = 0; k < 3; ++k) {
    const Eigen::AngleAxisd turn(1.2 * (k + 1), axis);
    const Eigen::Matrix3Xd pose =
        (turn.toRotationMatrix() * scene.mesh.nodes).colwise() + (k + 1) * shift;
    scene::Keyframe keyframe;
    keyframe.frame = 10 * (k + 1) - 1;
    keyframe.pose = std::make_shared<const Eigen::VectorXd>((pose - scene.mesh.nodes).reshaped());
    keyframe.weight = kInfinity;
    scene.keyframes.push_back(keyframe);
  }
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(live.recorder->fault(), "");
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  for (const auto& keyframe : scene.keyframes)
    EXPECT_LT(distance(live.session, *final, keyframe), 1e-3 * kLength);
}

}  // namespace
}  // namespace limber::session
