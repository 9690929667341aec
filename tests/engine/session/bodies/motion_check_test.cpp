// The error of the motion that is shown: final results are amended with it (session.h).

#include "engine/session/bodies/motion_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <deque>
#include <limits>
#include <map>

#include "engine/base/parallel.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"
#include "engine/session/bodies/keyframe_targets.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/pose_shares.h"
#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::bent_bar;
using test::held;
using test::kTip;
using test::Live;
using test::Pool;
using test::Recorder;
using ::testing::HasSubstr;
using ::testing::Not;

/// Full reconstructions by dense least squares on the gradients of all tets.
class Literal {
 public:
  Literal(const BodySession& session, const BodyResult& result)
      : session_(session),
        mapped_(map_body(*session.unedited())),
        gradient_(mapped_.body.mesh),
        mass_(bodies::lumped_node_mass(mapped_.body.mesh)) {
    const Eigen::MatrixXd all = gradient_.matrix();
    std::vector<bool> is_fixed(static_cast<std::size_t>(all.cols() / 3), false);
    for (const int node : mapped_.body.fixed_nodes) is_fixed[static_cast<std::size_t>(node)] = true;
    for (int i = 0; i < all.cols(); ++i)
      if (!is_fixed[static_cast<std::size_t>(i / 3)]) columns_.push_back(i);
    weight_.resize(all.rows());
    for (int i = 0; i < all.rows(); ++i) weight_[i] = std::sqrt(gradient_.volumes()[i / 9]);
    const Eigen::MatrixXd weighted = weight_.asDiagonal() * all(Eigen::all, columns_);
    solver_.compute(weighted);
    base_ = Eigen::MatrixXd::Zero(all.cols(), session.unedited()->frame_count);
    if (session.unedited()->base_motion.size() > 0)
      base_ = map_base_motion(*session.unedited(), mapped_.source_of_compact);
    const reduced::RsInverse inverse(mapped_.body, gradient_);
    reduced::RsTrack track;
    for (int frame = 0; frame < base_.cols(); ++frame)
      base_rs_.push_back(inverse.coordinates(base_.col(frame), track));
    add_rests_of_keyframes(result);
  }

  [[nodiscard]] Eigen::VectorXd shape(const BodyResult& result, int frame) const {
    const Eigen::VectorXd linear =
        session_.model()->modes * (result.material->mixing * result.modal.col(frame));
    Eigen::VectorXd g(weight_.size());
    for (int e = 0; e < gradient_.tet_count(); ++e) {
      const reduced::RsVector y = base_rs_[static_cast<std::size_t>(frame)].segment<9>(9 * e) +
                                  reduced::rs_of_gradient(gradient_.apply(linear, e));
      g.segment<9>(9 * e) = reduced::displacement_gradient(y).reshaped();
    }
    Eigen::VectorXd u = Eigen::VectorXd::Zero(linear.size());
    const Eigen::VectorXd solution = solver_.solve(weight_.cwiseProduct(g));
    u(columns_) = solution;
    if (!mapped_.body.is_free()) return u;
    const Eigen::Vector3d shift =
        ((linear + base_.col(frame) - u).reshaped(3, mass_.size()) * mass_) / mass_.sum();
    u.reshaped(3, mass_.size()).colwise() += shift;
    return u;
  }

  /// As the client has it.
  [[nodiscard]] Eigen::VectorXd shown(const BodyResult& result, int frame) const {
    return session_.positions(result, frame, 1).col(0) - session_.unedited()->mesh.nodes.reshaped();
  }

  [[nodiscard]] int inverted(const Eigen::VectorXd& u) const {
    int count = 0;
    const bodies::TetMesh& mesh = mapped_.body.mesh;
    for (Eigen::Index e = 0; e < mesh.tets.cols(); ++e) {
      Eigen::Matrix3d edges;
      for (int a = 0; a < 3; ++a) {
        const int to = mesh.tets(a + 1, e), from = mesh.tets(0, e);
        edges.col(a) = mesh.nodes.col(to) + u.segment<3>(3 * to) - mesh.nodes.col(from) -
                       u.segment<3>(3 * from);
      }
      if (edges.determinant() <= 0) ++count;
    }
    return count;
  }

  [[nodiscard]] bool is_free() const { return mapped_.body.is_free(); }

 private:
  void add_rests_of_keyframes(const BodyResult& result) {
    const scene::Scene scene = session_.scene();
    KeyframeTargets projection(*session_.unedited(), session_.model());
    const std::vector<KeyframeTarget> targets = projection.project(scene.keyframes);
    std::vector<spacetime::KeyframeConstraint> keyframes;
    keyframes.reserve(targets.size());
    for (const KeyframeTarget& target : targets) keyframes.push_back(target.constraint);
    const spacetime::Timeline timeline{scene.frame_count, map_end(scene.first_end),
                                       map_end(scene.last_end)};
    for (std::size_t k = 0; k < targets.size(); ++k) {
      if (!targets[k].rest) continue;
      const Eigen::VectorXd share =
          spacetime::pose_share(k, keyframes, result.material->dynamics, timeline);
      for (std::size_t frame = 0; frame < base_rs_.size(); ++frame) {
        base_rs_[frame] +=
            share[static_cast<Eigen::Index>(frame)] * targets[k].rest->coordinates.cast<double>();
      }
    }
  }

  const BodySession& session_;
  MappedBody mapped_;
  bodies::GradientOperator gradient_;
  Eigen::VectorXd mass_, weight_;
  std::vector<int> columns_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver_;
  Eigen::MatrixXd base_;
  std::vector<Eigen::VectorXd> base_rs_;
};

std::vector<int> constrained_frames(const BodySession& session) {
  std::vector<int> frames;
  for (const auto& constraint : session.constraints()) {
    if (constraint.kind == scene::TargetKind::kVelocity) {
      frames.push_back(constraint.frame - 1);
      frames.push_back(constraint.frame + 1);
    } else {
      frames.push_back(constraint.frame);
    }
  }
  for (const auto& keyframe : session.keyframes()) frames.push_back(keyframe.frame);
  return frames;
}

/// All numbers of an amendment, against literal reconstructions of the frames that are compared.
void expect_literal(const BodySession& session, const BodyResult& result) {
  ASSERT_TRUE(result.motion_check);
  const reduced::MotionError& error = result.motion_check->error;
  const Literal literal(session, result);
  std::map<int, Eigen::VectorXd> full;
  double differences = 0, displacements = 0, distance = 0;
  int inverted = 0;
  std::vector<double> alone, moved;
  const std::vector<int> frames =
      frames_to_compare(constrained_frames(session), result.coordinates);
  for (const int frame : frames) {
    const Eigen::VectorXd u = literal.shape(result, frame), s = literal.shown(result, frame);
    full[frame] = u;
    Eigen::Matrix3Xd reference = u.reshaped(3, u.size() / 3);
    if (literal.is_free()) reference.colwise() -= reference.rowwise().mean().eval();
    alone.push_back((s - u).squaredNorm());
    moved.push_back(reference.squaredNorm());
    differences += alone.back();
    displacements += moved.back();
    distance = std::max(distance, (s - u).reshaped(3, u.size() / 3).colwise().norm().maxCoeff());
    inverted = std::max(inverted, literal.inverted(s));
  }
  double worst = 0, missed = 0, velocity_missed = 0;
  const double least = 0.01 * displacements / static_cast<double>(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i)
    worst = std::max(worst, std::sqrt(alone[i] / std::max(moved[i], least)));
  for (const scene::Constraint& constraint : session.constraints()) {
    const auto mean = [&](int frame) -> Eigen::Vector3d {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const int node : constraint.nodes) sum += full.at(frame).segment<3>(3 * node);
      return sum / static_cast<double>(constraint.nodes.size());
    };
    if (constraint.kind == scene::TargetKind::kVelocity) {
      const Eigen::Vector3d velocity =
          (mean(constraint.frame + 1) - mean(constraint.frame - 1)) / 2 * result.frames_per_second;
      velocity_missed = std::max(velocity_missed, (velocity - constraint.target).norm());
    } else {
      missed = std::max(missed, (mean(constraint.frame) - constraint.target).norm());
    }
  }
  const double expected = std::sqrt(differences / displacements);
  EXPECT_GT(expected, 1e-5);  // else single precision of the frames is what is measured
  constexpr double kSame = 1e-3;
  EXPECT_NEAR(error.shape_error, expected, kSame * expected);
  EXPECT_NEAR(error.worst_frame_error, worst, kSame * worst);
  EXPECT_NEAR(error.max_distance, distance, kSame * distance);
  EXPECT_NEAR(error.max_constraint_error, missed, kSame * distance + kSame * missed);
  EXPECT_NEAR(error.max_velocity_error * result.frames_per_second, velocity_missed,
              kSame * velocity_missed + kSame * distance * result.frames_per_second);
  EXPECT_EQ(error.inverted_tets, inverted);
  EXPECT_EQ(error.frames, static_cast<int>(frames.size()));
  EXPECT_EQ(result.motion_check->tolerance, session.unedited()->model.tolerance);
}

TEST(MotionCheck, AFinalResultIsAmendedWithTheErrorOfItsMotion) {
  Live live(bent_bar());
  const auto final = live.recorder->wait_final(0);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(final && checked);
  EXPECT_EQ(final->check, Check::kPending);
  EXPECT_EQ(checked->check, Check::kDone);
  EXPECT_EQ(checked->sequence, final->sequence + 1);
  EXPECT_EQ(checked->revision, final->revision);
  EXPECT_EQ(checked->since_edit_ms, final->since_edit_ms);
  EXPECT_EQ(checked->coordinates, final->coordinates);
  EXPECT_EQ(checked->report.total_energy, final->report.total_energy);
  EXPECT_TRUE(checked->is_final);
  EXPECT_EQ(live.session.newest_result(), checked);
  EXPECT_EQ(live.session.final_result(), checked);
  for (const auto& result : live.recorder->results())
    EXPECT_EQ(result->check == Check::kNone, !result->is_final) << result->sequence;
  expect_literal(live.session, *checked);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(MotionCheck, OfAFreeBodyAndGroupsOfNodes) {
  scene::Scene scene = bent_bar();
  scene.fixed_nodes.clear();
  scene.constraints = {held(10, kTip, {0.1, 0.4, 0.05}), held(20, 0, {0, -0.3, 0.02})};
  scene.constraints[1].nodes = {0, 7, 14};
  Live live(scene);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked);
  expect_literal(live.session, *checked);
}

TEST(MotionCheck, OfVelocities) {
  scene::Scene scene = bent_bar();
  scene.constraints.push_back(held(15, kTip, {0, 1, -0.5}));
  scene.constraints.back().kind = scene::TargetKind::kVelocity;
  scene.constraints.back().weight = test::kInfinity;
  scene.constraints.push_back(held(6, kTip, {0, 3, 0}));
  scene.constraints.back().kind = scene::TargetKind::kVelocity;
  scene.constraints.back().weight = 0.01;
  Live live(scene);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked);
  EXPECT_GT(checked->motion_check->error.max_velocity_error, 1e-3);
  EXPECT_GT(checked->motion_check->error.max_exact_velocity_error, 0);
  EXPECT_EQ(checked->motion_check->shown_velocity_error, checked->report.max_velocity_error);
  expect_literal(live.session, *checked);
}

TEST(MotionCheck, OverABaseMotionAndWithAKeyframe) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  const Eigen::MatrixXd positions = source.session.positions(*motion, 0, 30);
  for (const bool is_free : {false, true}) {
    scene::Scene scene = bent_bar();
    if (is_free) scene.fixed_nodes.clear();
    scene.base_motion = positions.colwise() - positions.col(0);
    scene.constraints = {held(14, kTip, {0, 0.12, 0})};
    scene::Keyframe keyframe;
    keyframe.frame = 20;
    keyframe.pose = std::make_shared<const Eigen::VectorXd>(scene.base_motion.col(10));
    scene.keyframes = {keyframe};
    Live live(scene);
    auto checked = live.recorder->wait_checked(0);
    ASSERT_TRUE(checked);
    expect_literal(live.session, *checked);
    // Another frame, from what is known of the base motion by now.
    checked = live.recorder->wait_checked(
        live.session.edit({AddConstraint{held(5, kTip, {0, 0, 0.05})}}).revision);
    ASSERT_TRUE(checked);
    expect_literal(live.session, *checked);
  }
}

TEST(MotionCheck, WithAFittedMaterial) {
  scene::Scene scene = bent_bar();
  scene.material_optimisation.variables = scene::MaterialVariables::kAll;
  Live live(scene);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked);
  EXPECT_GT(checked->material_iterations, 0);
  expect_literal(live.session, *checked);
}

TEST(MotionCheck, OfAModelFromTheCache) {
  const auto first = Live(bent_bar()).recorder->wait_checked(0);
  Live live(bent_bar());
  const auto again = live.recorder->wait_checked(0);
  ASSERT_TRUE(again);
  EXPECT_TRUE(live.session.model_from_cache());
  expect_literal(live.session, *again);
}

TEST(MotionCheck, DoesNotDependOnTheNumberOfThreads) {
  const auto check = [](int threads) {
    set_thread_count(threads);
    const auto result = test::solve_fresh(bent_bar(), test::shared_cache());
    set_thread_count(2);
    return *result->motion_check;
  };
  const MotionCheck one = check(1), three = check(3);
  EXPECT_EQ(one.error.shape_error, three.error.shape_error);
  EXPECT_EQ(one.error.worst_frame_error, three.error.worst_frame_error);
  EXPECT_EQ(one.error.max_constraint_error, three.error.max_constraint_error);
}

/// Tasks wait until the test runs them.
struct HeldTasks {
  std::deque<std::function<void()>> tasks;
  Executor executor() {
    return [this](std::function<void()> task) { tasks.push_back(std::move(task)); };
  }
  void run_first() {
    const auto task = std::move(tasks.front());
    tasks.pop_front();
    task();
  }
};

TEST(MotionCheck, ANewerEditComesBeforeTheCheck) {
  HeldTasks held_tasks;
  const auto recorder = std::make_shared<Recorder>();
  BodySession session("held", bent_bar(), {}, test::shared_cache(), held_tasks.executor(),
                      recorder);
  held_tasks.run_first();  // builds, solves, begins the check
  ASSERT_EQ(recorder->results().back()->check, Check::kPending);
  ASSERT_EQ(held_tasks.tasks.size(), 1u);
  session.edit({MoveConstraint{1, {0, 0.12, 0.05}}});
  ASSERT_EQ(held_tasks.tasks.size(), 2u);  // the check did not stop the edit from being posted
  held_tasks.run_first();                  // the check: nothing to do any more
  EXPECT_EQ(recorder->results().back()->revision, 0u);
  EXPECT_EQ(recorder->results().back()->check, Check::kPending);
  while (!held_tasks.tasks.empty()) held_tasks.run_first();
  int amendments = 0;
  for (const auto& result : recorder->results()) {
    if (result->check != Check::kDone) continue;
    ++amendments;
    EXPECT_EQ(result->revision, 1u);
  }
  EXPECT_EQ(amendments, 1);
  EXPECT_EQ(recorder->results().back()->check, Check::kDone);
  EXPECT_EQ(recorder->fault(), "");
}

TEST(MotionCheck, AnEditWhileTheAmendmentRuns) {
  HeldTasks held_tasks;
  const auto recorder = std::make_shared<Recorder>();
  BodySession session("held", bent_bar(), {}, test::shared_cache(), held_tasks.executor(),
                      recorder);
  held_tasks.run_first();
  held_tasks.run_first();  // the check; its news are waiting to be published
  ASSERT_EQ(held_tasks.tasks.size(), 1u);
  session.edit({MoveConstraint{1, {0, 0.12, 0.05}}});
  while (!held_tasks.tasks.empty()) held_tasks.run_first();
  const auto results = recorder->results();
  EXPECT_EQ(results.back()->check, Check::kDone);
  EXPECT_EQ(results.back()->revision, 1u);
  EXPECT_EQ(std::count_if(results.begin(), results.end(),
                          [](const auto& result) { return result->check == Check::kDone; }),
            1);
}

TEST(MotionCheck, ACancelledCheckStops) {
  const auto result = test::solve_fresh(bent_bar(), test::shared_cache());
  const Live live(bent_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  MotionChecker checker(live.session.unedited(), live.session.model());
  CheckRequest request;
  request.result = result;
  JobContext job;
  job.cancellation.request();
  try {
    (void)checker.check(request, job);
    FAIL() << "it was not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  EXPECT_GT(checker.check(request).error.shape_error, 0);  // and can be done again
}

TEST(MotionCheck, AnUndoneEditRegainsTheErrorOfItsMotion) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_checked(0);
  ASSERT_TRUE(before);
  const auto moved =
      live.recorder->wait_checked(live.session.edit({MoveConstraint{1, {0, 0.25, 0.1}}}).revision);
  ASSERT_TRUE(moved);
  ASSERT_NE(moved->motion_check->error.shape_error, before->motion_check->error.shape_error);
  const auto back = live.recorder->wait_checked(live.session.edit({Undo{}}).revision);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->revision, 2u);
  EXPECT_NEAR(back->motion_check->error.shape_error, before->motion_check->error.shape_error,
              1e-3 * before->motion_check->error.shape_error);
}

TEST(MotionCheck, AColdSolveThatKeepsTheAnswerKeepsItsError) {
  Live live(bent_bar());
  const auto warm = live.recorder->wait_checked(0);
  ASSERT_TRUE(warm);
  live.session.solve_cold(5);
  const auto cold = live.recorder->wait_checked(0, warm->sequence);
  ASSERT_TRUE(cold);
  EXPECT_EQ(cold->cold_request, 5u);
  EXPECT_NEAR(cold->motion_check->error.shape_error, warm->motion_check->error.shape_error,
              1e-2 * warm->motion_check->error.shape_error);
}

TEST(MotionCheck, AnExecutorThatRefusesTheCheck) {
  int taken = 0;
  const Executor executor = [&](const std::function<void()>& task) {
    if (++taken == 2) throw std::runtime_error("no more threads");
    task();
  };
  const BodySession session("refused", bent_bar(), {}, test::shared_cache(), executor, nullptr);
  const auto result = session.final_result();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->check, Check::kDone);
  EXPECT_FALSE(result->motion_check);
  EXPECT_THAT(result->report.message, HasSubstr("could not be determined"));
  EXPECT_THAT(result->report.message, HasSubstr("no more threads"));
}

TEST(MotionCheck, AnEditWhileTheExecutorRefusesTheCheckIsPublishedLast) {
  int taken = 0;
  BodySession* open = nullptr;
  std::deque<std::function<void()>> tasks;
  const Executor executor = [&](std::function<void()> task) {
    if (++taken == 2) {  // the check
      open->edit({MoveConstraint{1, {0, 0.12, 0.05}}});
      throw std::runtime_error("no more threads");
    }
    tasks.push_back(std::move(task));
  };
  const auto recorder = std::make_shared<Recorder>();
  BodySession session("refused", bent_bar(), {}, test::shared_cache(), executor, recorder);
  open = &session;
  for (; !tasks.empty(); tasks.pop_front()) tasks.front()();
  EXPECT_EQ(taken, 4);  // the session, its check, that of the edit, and its amendment
  Revision newest = 0;
  for (const auto& result : recorder->results()) {
    EXPECT_GE(result->revision, newest) << result->sequence;
    newest = result->revision;
  }
  EXPECT_EQ(newest, 1u);
  EXPECT_TRUE(session.newest_result()->motion_check);
  EXPECT_EQ(recorder->fault(), "");
}

TEST(MotionCheck, ChecksThatAreAlwaysCancelledFinishTheirPreparation) {
  const Live live(bent_bar());
  CheckRequest request;
  request.result = live.recorder->wait_final(0);
  ASSERT_TRUE(request.result);
  scene::Scene scene = *live.session.unedited();
  scene.base_motion = Eigen::MatrixXd::Zero(scene.mesh.nodes.size(), scene.frame_count);
  const auto with_base = std::make_shared<const scene::Scene>(scene);
  MotionChecker interrupted(with_base, live.session.model());
  MotionChecker at_once(with_base, live.session.model());
  JobContext job;
  job.cancellation.request();
  for (int i = 0; i < 5; ++i) EXPECT_THROW((void)interrupted.check(request, job), Error) << i;
  EXPECT_EQ(interrupted.check(request).error.shape_error, at_once.check(request).error.shape_error);
}

TEST(MotionCheck, TargetsBeyondReachAreReported) {
  for (const double lengths : {2.0, 10.0, 50.0}) {
    scene::Scene scene = test::bar(test::kCells, 30);
    scene.dynamics = testing::published_dynamics();
    const double length = 0.1 * test::kCells;
    scene.constraints = {held(10, kTip, {0, lengths * length, 0}),
                         held(20, kTip, {0, -0.5 * lengths * length, lengths * length})};
    Live live(scene);
    const auto checked = live.recorder->wait_checked(0);
    ASSERT_TRUE(checked);
    const std::string& message = checked->report.message;
    EXPECT_GT(checked->motion_check->error.inverted_tets, 0) << lengths;
    EXPECT_THAT(message, HasSubstr("inverted in frame")) << lengths;
    EXPECT_THAT(message, HasSubstr("outside of what the model was trained for")) << lengths;
    if (lengths >= 10) {
      EXPECT_THAT(message, HasSubstr("The motion is far outside")) << lengths;
      EXPECT_THAT(message, HasSubstr("Constraint 2 in frame 20 is out of reach: its target is "))
          << lengths;
    }
    EXPECT_THAT(message, HasSubstr("Move targets nearer")) << lengths;
  }
}

TEST(MotionCheck, ATargetMissedByBodyLengthsIsReportedWhereTheShapesAreExact) {
  limber::session::MotionCheck check;
  check.length = 2;
  check.tolerance = 0.01;
  check.trained_reach = 1;
  check.error.max_constraint_error = check.shown_constraint_error = 0.9;
  EXPECT_EQ(describe_motion(check), "");
  check.error.max_constraint_error = check.shown_constraint_error = 20;
  EXPECT_THAT(describe_motion(check), HasSubstr("A constraint is missed by 10 body lengths"));
  EXPECT_THAT(describe_motion(check), HasSubstr("raise the weight"));
}

/// A check that finds nothing wrong, of a body of 2 m in a scene in millimetres.
limber::session::MotionCheck sound_check() {
  limber::session::MotionCheck check;
  check.length = 2;
  check.length_unit = 1e-3;
  check.tolerance = 0.01;
  check.trained_reach = 1;
  check.error.shape_error = 0.004;
  check.error.worst_frame_error = 0.009;
  check.error.worst_frame = 7;
  check.error.frames = 33;
  check.error.max_constraint_error = check.shown_constraint_error = 0.05;
  return check;
}

TEST(MotionCheck, FullShapesThatMissTheScenesConstraintToleranceAreReported) {
  limber::session::MotionCheck check = sound_check();
  EXPECT_EQ(describe_motion(check), "");
  check.constraint_tolerance = 0.06;
  EXPECT_EQ(describe_motion(check), "");
  check.constraint_tolerance = 0.04;
  EXPECT_THAT(
      describe_motion(check),
      HasSubstr("The full shapes miss a constraint by 50 (2.5 % of the body's length), more "
                "than constraint_tolerance, 40. The shown shapes miss it as much"));
  check.shown_constraint_error = 0.01;
  EXPECT_THAT(describe_motion(check), HasSubstr("A smaller model.tolerance"));
}

TEST(MotionCheck, FullShapesThatMissAnExactConstraintAreReported) {
  limber::session::MotionCheck check = sound_check();
  check.error.max_exact_error = 0.9 * kMinVisibleMiss * check.length;
  EXPECT_EQ(describe_motion(check), "");
  check.error.max_exact_error = 0.01;
  EXPECT_THAT(describe_motion(check), HasSubstr("The full shapes miss an exact constraint by 10 "
                                                "(0.5 % of the body's length)."));
}

TEST(MotionCheck, FullShapesThatMissByHalfMoreThanTheShownOnesAreReported) {
  limber::session::MotionCheck check = sound_check();
  check.error.max_constraint_error = 0.074;
  EXPECT_EQ(describe_motion(check), "");
  check.error.max_constraint_error = 0.076;
  EXPECT_THAT(describe_motion(check),
              HasSubstr("Constraints are missed by up to 76 (3.8 % of the body's length) in the "
                        "full shapes, 50 in the shown ones."));
  check.shown_constraint_error = 0;
  check.error.max_constraint_error = 0.9 * kMinVisibleMiss * check.length;
  EXPECT_EQ(describe_motion(check), "") << "cannot be seen";
}

TEST(MotionCheck, FullShapesThatMissAVelocityAreReported) {
  limber::session::MotionCheck check = sound_check();
  const double visible = kMinVisibleMiss * check.length / kVisibleFrames;
  check.frames_per_second = 25;
  check.error.max_velocity_error = check.error.max_exact_velocity_error = 0.9 * visible;
  EXPECT_EQ(describe_motion(check), "") << "cannot be seen";
  check.error.max_velocity_error = check.error.max_exact_velocity_error = 0.004;
  EXPECT_THAT(
      describe_motion(check),
      HasSubstr("The full shapes miss an exact velocity by 100 a second. Velocities are "
                "missed by up to 100 a second in the full shapes, 0 a second in the shown"));
  check.error.max_exact_velocity_error = 0;
  check.shown_velocity_error = 0.003;
  EXPECT_EQ(describe_motion(check), "") << "the shown ones miss as much";
}

TEST(MotionCheck, AFrameThatIsOffByMoreThanTheToleranceIsReported) {
  limber::session::MotionCheck check = sound_check();
  check.error.worst_frame_error = 0.03;
  EXPECT_THAT(
      describe_motion(check),
      HasSubstr("off by 3 % from the full reconstruction of the same modes in frame 7, more "
                "than model.tolerance (1 %), though by 0.4 % only over all"));
}

TEST(MotionCheck, InvertedTetsAreReportedWithTheNumberOfFramesThatWereCompared) {
  limber::session::MotionCheck check = sound_check();
  check.error.inverted_tets = 2;
  check.error.inverted_frame = 9;
  EXPECT_THAT(describe_motion(check),
              HasSubstr("2 tets are inverted in frame 9, the worst of the 33 frames compared."));
  EXPECT_THAT(describe_motion(check), Not(HasSubstr("out of reach")));
  check.farthest_target = 20 * check.length;
  check.farthest_target_frame = 9;
  check.farthest_target_id = 4;
  EXPECT_THAT(
      describe_motion(check),
      HasSubstr(
          "Constraint 4 in frame 9 is out of reach: its target is 20 body lengths from rest"));
  // An arm of the octopus, pulled away from its hold: met with a linear displacement of 43 L.
  check.farthest_target = 0.25 * check.length;
  EXPECT_THAT(describe_motion(check), Not(HasSubstr("out of reach")));
  check.error.linear_reach = 5 * check.trained_reach;
  EXPECT_THAT(
      describe_motion(check),
      HasSubstr(
          "Constraint 4 in frame 9 is out of reach: its target is 0.25 body lengths from rest"));
}

TEST(MotionCheck, AFittedMotionWithLargerStepsThanForcesAloneIsReported) {
  limber::session::MotionCheck check = sound_check();
  check.largest_step = check.largest_step_of_start = 0.02;
  EXPECT_EQ(describe_motion(check), "");
  check.largest_step = 0.032;
  EXPECT_THAT(describe_motion(check),
              HasSubstr("moves a node by up to 32 from one frame to the next, 1.6 times as far as "
                        "the motion with forces alone that the fit began with"));
}

/// A model of few shapes cannot do what an exact constraint and a tolerance of the scene ask for.
TEST(MotionCheck, OfACoarseModelSaysWhatTheFullShapesMiss) {
  scene::Scene scene = bent_bar();
  scene.model.basis_size = 4;
  scene.constraints[0].weight = std::numeric_limits<double>::infinity();
  scene.constraint_tolerance = 1e-3;
  SessionOptions options;
  options.exactness = Exactness::kReduced;
  Live live(scene, options);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked);
  const reduced::MotionError& error = checked->motion_check->error;
  EXPECT_LT(checked->report.max_exact_error, 1e-5);
  ASSERT_GT(error.max_exact_error, kMinVisibleMiss * checked->motion_check->length);
  EXPECT_LE(error.max_exact_error, error.max_constraint_error);
  EXPECT_EQ(checked->motion_check->shown_constraint_error, checked->report.max_constraint_error);
  EXPECT_THAT(checked->report.message, HasSubstr("more than constraint_tolerance, 0.001"));
  EXPECT_THAT(checked->report.message, HasSubstr("The full shapes miss an exact constraint by"));
  EXPECT_THAT(checked->report.message, HasSubstr("in the shown ones"));
}

TEST(MotionCheck, PercentagesOfAnySizeAreReadable) {
  limber::session::MotionCheck check;
  check.length = 1;
  check.tolerance = 0.01;
  check.error.worst_frame = 7;
  for (const auto& [share, text] :
       {std::pair{0.0123, "off by 1.23 %"}, std::pair{0.9999, "off by 100 %"},
        std::pair{1.234, "off by 123 %"}, std::pair{9.996, "off by 1000 %"},
        std::pair{24.3, "off by more than 1000 %"}}) {
    check.error.shape_error = share;
    check.error.worst_frame_error = 1e12;
    EXPECT_THAT(describe_motion(check), HasSubstr(text));
    EXPECT_THAT(describe_motion(check), HasSubstr("more than 1000 % in frame 7"));
    EXPECT_THAT(describe_motion(check), Not(HasSubstr("e+")));
  }
}

TEST(MotionCheck, SmallTargetsWithinTheToleranceGetNoMessage) {
  scene::Scene scene = bent_bar();
  scene.constraints = {held(10, kTip, {0, 0.01, 0.005})};
  scene.model.tolerance = 0.05;
  Live live(scene);
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked);
  EXPECT_TRUE(checked->motion_check->within_tolerance());
  EXPECT_EQ(checked->motion_check->error.inverted_tets, 0);
  EXPECT_THAT(checked->report.message, Not(HasSubstr("shown motion")));
}

TEST(MotionCheck, AModelThatMissesItsToleranceSaysSoInEveryFinalResult) {
  scene::Scene scene = bent_bar();
  scene.model.basis_size = 4;
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  ASSERT_FALSE(live.session.model()->report.met_tolerance);
  EXPECT_THAT(final->report.message, HasSubstr("The model misses its tolerance: mean error"));
  EXPECT_THAT(live.edit({MoveConstraint{1, {0, 0.12, 0.05}}})->report.message,
              HasSubstr("model.tolerance is 1 %"));
}

TEST(FramesToCompare, AreBoundedForThousandsOfConstraintsAndFrames) {
  Eigen::MatrixXf coordinates = Eigen::MatrixXf::Zero(4, 5000);
  coordinates(2, 3333) = 1;
  std::vector<int> constrained;
  for (int i = 4999; i >= 0; --i) constrained.insert(constrained.end(), {i, i});
  const std::vector<int> frames = frames_to_compare(constrained, coordinates);
  EXPECT_LE(frames.size(), static_cast<std::size_t>(kMaxConstrainedFrames + kSpreadFrames + 1));
  EXPECT_GE(frames.size(), static_cast<std::size_t>(kMaxConstrainedFrames));
  EXPECT_TRUE(std::is_sorted(frames.begin(), frames.end()));
  EXPECT_EQ(frames.front(), 0);
  EXPECT_EQ(frames.back(), 4999);
  EXPECT_TRUE(std::binary_search(frames.begin(), frames.end(), 3333));
}

TEST(FramesToCompare, AreAllOfAShortMotionAndEveryConstrainedOne) {
  const Eigen::MatrixXf still = Eigen::MatrixXf::Zero(4, 7);
  EXPECT_THAT(frames_to_compare({}, still), ::testing::ElementsAre(0, 1, 2, 3, 4, 5, 6));
  const Eigen::MatrixXf longer = Eigen::MatrixXf::Zero(4, 301);
  const std::vector<int> frames = frames_to_compare({77, 78, 3}, longer);
  for (const int frame : {0, 3, 20, 77, 78, 300})
    EXPECT_TRUE(std::binary_search(frames.begin(), frames.end(), frame)) << frame;
  EXPECT_EQ(frames.size(), 19u);
}

}  // namespace
}  // namespace limber::session
