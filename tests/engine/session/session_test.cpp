#include "engine/session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/engine/session/harness.h"
#include "tests/engine/session/scenes.h"

namespace limber::session {
namespace {

using scene::End;
using scene::TargetKind;
using spacetime::SolveStatus;
using test::bar_node;
using test::held;
using test::Recorder;

constexpr int kCells = 6;
const int kTip = bar_node(kCells, kCells, 1, 2);
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The bar of the tests with its tip held aside in two frames.
scene::Scene bent_bar() {
  scene::Scene scene = test::bar(kCells, 30);
  scene.constraints = {held(10, kTip, {0, 0.1, 0.05}), held(20, kTip, {0, -0.1, 0.02})};
  return scene;
}

/// A session on threads of its own, with everything it says.
struct Live {
  explicit Live(scene::Scene scene, SessionOptions options = {})
      : session("live", std::move(scene), options, test::shared_cache(), pool.executor(),
                recorder) {}
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  test::Pool pool{1};
  Session session;

  std::shared_ptr<const Result> edit(const std::vector<Edit>& edits) {
    return recorder->wait_final(session.edit(edits).revision);
  }
};

Eigen::Vector3d tip_at(const Session& session, const Result& result, int frame) {
  return session.positions(result, frame, 1).col(0).segment<3>(3 * kTip);
}

TEST(Session, FirstResultThenFinalForTheSceneAsOpened) {
  Live live(bent_bar());
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(live.session.state(), State::kReady);
  const auto results = live.recorder->results();
  ASSERT_GE(results.size(), 2u);
  EXPECT_FALSE(results.front()->converged);
  EXPECT_EQ(results.front()->sequence, 1u);
  EXPECT_EQ(results.front()->revision, 0u);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_GT(final->since_edit_ms, 0);
  EXPECT_THAT(live.recorder->states(), testing::ElementsAre(State::kReady));
  EXPECT_THAT(live.recorder->progress(), testing::Not(testing::IsEmpty()));
  EXPECT_EQ(live.recorder->fault(), "");

  const auto model = live.session.model();
  EXPECT_EQ(final->modal.rows(), model->coordinate_count());
  EXPECT_EQ(final->modal.cols(), 30);
  EXPECT_EQ(final->coordinates.rows(), model->basis_size());
  EXPECT_EQ(final->coordinates.cols(), 30);
  // The frames show what the report says: the tip is where it was asked to be, the clamped ends are
  // at rest.
  const Eigen::Vector3d rest = live.session.geometry()->rest.col(kTip);
  const double error =
      (tip_at(live.session, *final, 10) - rest - Eigen::Vector3d(0, 0.1, 0.05)).norm();
  EXPECT_LT(error, 0.02);
  EXPECT_LE(error, final->report.max_constraint_error * std::sqrt(3.0) + 1e-6);
  for (const int frame : {0, 1, 28, 29})
    EXPECT_LT((tip_at(live.session, *final, frame) - rest).norm(), 1e-6) << frame;
  EXPECT_GT((tip_at(live.session, *final, 15) - rest).norm(), 1e-3);
  EXPECT_EQ(live.session.newest_result(), final);
  EXPECT_EQ(live.session.converged_result(), final);
}

TEST(Session, AnEditIsFirstCorrectedThenFinal) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_final(0);
  ASSERT_TRUE(before);
  const auto after = live.edit({MoveConstraint{1, {0, 0.12, 0.05}}});
  ASSERT_TRUE(after);
  EXPECT_EQ(after->revision, 1u);
  const auto results = live.recorder->results();
  const auto& first = results[before->sequence];
  EXPECT_FALSE(first->converged);
  EXPECT_EQ(first->revision, 1u);
  const double asked = live.session.geometry()->rest(1, kTip) + 0.12;
  // Already the first motion goes most of the way.
  EXPECT_LT(std::abs(tip_at(live.session, *first, 10).y() - asked), 0.25 * 0.02);
  EXPECT_LT(std::abs(tip_at(live.session, *after, 10).y() - asked), 0.25 * 0.02);
  EXPECT_LE(after->report.total_energy, first->report.total_energy * (1 + 1e-9));
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(Session, ValidatesTheSceneAtOnce) {
  scene::Scene scene = bent_bar();
  scene.constraints[1].frame = 30;
  const auto never = [](const std::function<void()>&) {
    FAIL() << "a task for a scene that was refused";
  };
  try {
    const Session session("bad", scene, {}, nullptr, never, nullptr);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "constraints[1].frame");
  }
  scene = bent_bar();
  scene.mesh.tets(2, 3) = 100000;
  EXPECT_THROW(Session("bad", scene, {}, nullptr, never, nullptr), Error);
  EXPECT_THROW(Session("bad", bent_bar(), {}, nullptr, {}, nullptr), Error);
  SessionOptions options;
  options.undo_depth = -1;
  EXPECT_THROW(Session("bad", bent_bar(), options, nullptr, never, nullptr), Error);
}

TEST(Session, ARefusedEditLeavesEverythingAsItWas) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_final(0);
  try {
    live.session.edit({MoveConstraint{1, {0, 0, 0}}, RemoveConstraint{9}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_EQ(error.field(), "edits[1].remove.id");
  }
  EXPECT_EQ(live.session.revision(), 0u);
  EXPECT_EQ(live.session.constraints()[0].target.y(), 0.1);
  EXPECT_EQ(live.session.newest_result(), before);
  EXPECT_TRUE(live.edit({MoveConstraint{1, {0, 0.11, 0}}}));
}

TEST(Session, OptimisticLocking) {
  Live live(bent_bar());
  EXPECT_EQ(live.session.edit({MoveConstraint{1, {0, 0.11, 0}}}, 0).revision, 1u);
  try {
    live.session.edit({MoveConstraint{1, {0, 0.12, 0}}}, 0);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
  }
  EXPECT_EQ(live.session.edit({MoveConstraint{1, {0, 0.12, 0}}}, 1).revision, 2u);
}

TEST(Session, EditsWhileBuildingAreInTheFirstResult) {
  const auto recorder = std::make_shared<Recorder>();
  std::function<void()> task;
  {
    Session session(
        "slow", bent_bar(), {}, test::shared_cache(),
        [&](std::function<void()> t) { task = std::move(t); }, recorder);
    EXPECT_EQ(session.state(), State::kBuilding);
    EXPECT_FALSE(session.geometry());
    EXPECT_FALSE(session.model());
    EXPECT_FALSE(session.newest_result());
    EXPECT_THROW((void)session.positions({}, 0, 1), Error);
    session.edit({RemoveConstraint{1}});
    session.edit({MoveConstraint{2, {0, 0.05, 0}}});
    std::exchange(task, nullptr)();
    EXPECT_EQ(recorder->results().front()->revision, 2u);
    EXPECT_TRUE(recorder->results().back()->converged);
    EXPECT_FALSE(task);
  }
}

TEST(Session, UndoComesBackToTheEnergyAndRedoLeavesIt) {
  Live live(bent_bar());
  const double opened = live.recorder->wait_final(0)->report.total_energy;
  const double moved = live.edit({MoveConstraint{1, {0, 0.2, 0}},
                                  SetEnds{End::kPinnedPosition, End::kPinnedPosition}})
                           ->report.total_energy;
  const double dynamics = live.edit({SetDynamics{{30, 15, 0.02}}})->report.total_energy;
  EXPECT_GT(std::abs(moved - opened), 1e-3 * opened);
  EXPECT_GT(std::abs(dynamics - moved), 1e-3 * moved);
  EXPECT_NEAR(live.edit({Undo{}})->report.total_energy, moved, 1e-6 * moved);
  EXPECT_NEAR(live.edit({Undo{}})->report.total_energy, opened, 1e-6 * opened);
  EXPECT_NEAR(live.edit({Redo{}, Redo{}})->report.total_energy, dynamics, 1e-6 * dynamics);
}

TEST(Session, EveryKindOfEditEndsAtAColdSolve) {
  Live live(bent_bar());
  scene::Constraint group = held(15, kTip, {0.0, 0.02, 0.1});
  group.nodes = {kTip, bar_node(kCells, kCells, 0, 0), bar_node(kCells, kCells, 0, 2)};
  scene::Constraint exact = held(7, bar_node(kCells, 3, 1, 1), {0, 0.02, 0});
  exact.weight = kInfinity;
  exact.axes = 2;
  scene::Constraint position = held(20, kTip, {kCells * 0.1, 0.1 + 0.05, 0.2});
  position.kind = TargetKind::kPosition;
  position.id = 2;
  live.edit({AddConstraint{group}});
  live.edit({AddConstraint{exact}, SetDynamics{{30, 25, 0.05}}});
  live.edit({ReplaceConstraint{position}});
  live.edit({RemoveConstraint{1}, SetEnds{End::kPinnedPosition, End::kPinnedPosition}});
  const auto final = live.edit({MoveConstraint{3, {0, 0.03, 0.08}}});
  const auto fresh = test::solve_fresh(live.session.scene(), test::shared_cache());
  ASSERT_TRUE(final && fresh);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_GT(fresh->report.total_energy, 1e-6);
  EXPECT_NEAR(final->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy);
  EXPECT_LT((final->modal - fresh->modal).norm(), 1e-4 * fresh->modal.norm());
  EXPECT_LT(final->report.max_exact_error, 1e-7);
}

TEST(Session, SavedAndReopenedItIsTheSame) {
  Live live(bent_bar());
  live.edit({AddConstraint{held(15, kTip, {0, 0, 0.1})}, RemoveConstraint{1},
             SetEnds{End::kPinnedPositionVelocity, End::kPinnedPosition},
             SetDynamics{{25, 22, 0.1}}});
  const scene::Scene saved = live.session.scene();
  EXPECT_THAT(saved.constraints, testing::SizeIs(2));
  EXPECT_EQ(saved.constraints[1].id, 3u);
  EXPECT_EQ(saved.last_end, End::kPinnedPosition);
  EXPECT_EQ(saved.dynamics.damping_ratio, 0.1);
  EXPECT_EQ(saved.mesh.nodes, bent_bar().mesh.nodes);
  Live again(saved);
  const double energy = live.session.converged_result()->report.total_energy;
  EXPECT_NEAR(again.recorder->wait_final(0)->report.total_energy, energy, 1e-6 * energy);
  EXPECT_THAT(again.session.edit({AddConstraint{held(3, kTip)}}).constraint_ids,
              testing::ElementsAre(4));
}

TEST(Session, SolveColdForgetsTheWarmStart) {
  Live live(bent_bar());
  const auto warm = live.edit({MoveConstraint{1, {0, 0.15, 0}}});
  live.session.solve_cold();
  const auto cold = live.recorder->wait_final(1, warm->sequence);
  ASSERT_TRUE(cold);
  EXPECT_EQ(cold->revision, 1u);
  EXPECT_NEAR(cold->report.total_energy, warm->report.total_energy,
              1e-6 * warm->report.total_energy);
}

TEST(Session, MillimetresAndMetresMoveAlike) {
  scene::Scene metres = bent_bar();
  metres.constraints.push_back(held(15, kTip, {0.6, 0.12, 0.25}));
  metres.constraints.back().kind = TargetKind::kPosition;
  metres.constraints.push_back(held(5, bar_node(kCells, 3, 0, 1), {0, 0.01, 0}));
  metres.constraints.back().weight = kInfinity;
  metres.dynamics.period_frames = 0;  // from materials: the unit must not slip in here either
  metres.dynamics.frames_per_second = 2000;
  scene::Scene millimetres = metres;
  millimetres.length_unit_in_metres = 0.001;
  millimetres.mesh.nodes *= 1000;
  for (scene::Constraint& constraint : millimetres.constraints) constraint.target *= 1000;
  Live a(metres), b(millimetres);
  const auto in_metres = a.recorder->wait_final(0), in_millimetres = b.recorder->wait_final(0);
  ASSERT_TRUE(in_metres && in_millimetres);
  EXPECT_NEAR(in_metres->report.total_energy, in_millimetres->report.total_energy,
              1e-6 * in_metres->report.total_energy);
  EXPECT_NEAR(in_metres->report.max_constraint_error, in_millimetres->report.max_constraint_error,
              1e-8);
  const Eigen::MatrixXd from_metres = 1000 * a.session.positions(*in_metres, 0, 30);
  const Eigen::MatrixXd from_millimetres = b.session.positions(*in_millimetres, 0, 30);
  EXPECT_LT((from_metres - from_millimetres).cwiseAbs().maxCoeff(),
            1e-3);  // a micrometre on 600 mm
  EXPECT_GT((from_metres.col(10) - from_metres.col(0)).norm(), 10);
}

TEST(Session, PositionAndDisplacementTargetsAgree) {
  scene::Scene scene = bent_bar();
  scene.constraints.resize(1);
  scene.constraints[0].nodes = {kTip, bar_node(kCells, kCells, 0, 0)};
  const auto displaced = test::solve_fresh(scene, test::shared_cache());
  scene.constraints[0].kind = TargetKind::kPosition;
  scene.constraints[0].target +=
      Eigen::Vector3d(0.6, 0.05, 0.1);  // mean of (0.6, 0.1, 0.2) and (0.6, 0, 0)
  const auto positioned = test::solve_fresh(scene, test::shared_cache());
  EXPECT_NEAR(displaced->report.total_energy, positioned->report.total_energy,
              1e-9 * displaced->report.total_energy);
}

TEST(Session, ThreeFramesOneFree) {
  scene::Scene scene = test::bar(kCells, 3);
  scene.first_end = scene.last_end = End::kPinnedPosition;
  scene.constraints = {held(1, kTip, {0, 0.05, 0})};
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_GT(tip_at(live.session, *final, 1).y(), 0.1 + 0.01);
  EXPECT_TRUE(live.edit({SetEnds{End::kFree, End::kFree}, MoveConstraint{1, {0, 0.1, 0}}}));
  EXPECT_LT(live.session.converged_result()->report.total_energy, final->report.total_energy);
}

TEST(Session, AFreeBodyFollowsItsConstraintsAcrossSpace) {
  scene::Scene scene = test::bar(kCells, 20);
  scene.fixed_nodes.clear();
  scene.first_end = scene.last_end = End::kFree;
  std::vector<int> middle;
  for (int j = 0; j <= 1; ++j) {
    for (int k = 0; k <= 2; ++k) middle.push_back(bar_node(kCells, 3, j, k));
  }
  scene.constraints = {held(0, 0), held(19, 0)};
  for (scene::Constraint& constraint : scene.constraints) constraint.nodes = middle;
  scene.constraints[1].target = {3, 1, -2};
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(live.session.model()->rigid_count, 6);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  // Moving freely at constant speed costs nothing.
  EXPECT_LT(final->report.total_energy, 1e-6);
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  const Eigen::VectorXd last = live.session.positions(*final, 19, 1);
  for (const int node : middle)
    moved += last.segment<3>(3 * node) - live.session.geometry()->rest.col(node);
  EXPECT_LT((moved / static_cast<double>(middle.size()) - Eigen::Vector3d(3, 1, -2)).norm(), 0.01);
}

TEST(Session, ABaseMotionIsKeptWhereNothingIsAsked) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  const Eigen::MatrixXd positions = source.session.positions(*motion, 0, 30);
  scene::Scene scene = test::bar(kCells, 30);
  scene.base_motion = positions.colwise() - positions.col(0);
  Live live(scene);
  auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_LT(final->report.total_energy, 1e-12);
  EXPECT_LT((live.session.positions(*final, 0, 30) - positions).cwiseAbs().maxCoeff(), 0.01);
  // Targets are displacements from rest, not from the base motion: asking for what it does changes
  // little.
  final =
      live.edit({AddConstraint{held(10, kTip, scene.base_motion.col(10).segment<3>(3 * kTip))}});
  EXPECT_LT(final->report.max_constraint_error, 0.005);
  EXPECT_LT((live.session.positions(*final, 0, 30) - positions).cwiseAbs().maxCoeff(), 0.02);
}

TEST(Session, ContradictingExactConstraintsGetALeastSquaresAnswer) {
  scene::Scene scene = bent_bar();
  scene.constraints.resize(1);
  scene.constraints.push_back(scene.constraints[0]);
  scene.constraints[1].target = {0, 0.2, 0.05};
  for (scene::Constraint& constraint : scene.constraints) constraint.weight = kInfinity;
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_TRUE(final->report.rank_deficient);
  EXPECT_FALSE(final->report.message.empty());
  EXPECT_NEAR(final->report.max_exact_error, 0.05, 0.005);
  const auto mended = live.edit({RemoveConstraint{2}});
  EXPECT_FALSE(mended->report.rank_deficient);
  EXPECT_LT(mended->report.max_exact_error, 1e-6);
}

TEST(Session, PositionsOfPartsAndBadRanges) {
  Live live(bent_bar());
  const auto final = live.recorder->wait_final(0);
  const Eigen::MatrixXd all = live.session.positions(*final, 0, 30);
  EXPECT_LT((live.session.positions(*final, 7, 5) - all.middleCols(7, 5)).norm(), 1e-12);
  EXPECT_EQ(live.session.positions(*final, 7, 0).cols(), 0);
  EXPECT_THROW((void)live.session.positions(*final, -1, 1), Error);
  EXPECT_THROW((void)live.session.positions(*final, 30, 0), Error);
  EXPECT_THROW((void)live.session.positions(*final, 29, 2), Error);
  EXPECT_THROW((void)live.session.positions(*final, 0, std::numeric_limits<int>::max()), Error);
  EXPECT_THROW((void)live.session.positions({}, 0, 1), Error);
}

TEST(Session, AddingAndRemovingTenThousandTimesLeavesTheStateWhereItWas) {
  Live live(bent_bar());
  const double energy = live.recorder->wait_final(0)->report.total_energy;
  std::uint64_t id = 0;
  for (int i = 0; i < 10000; ++i) {
    id = live.session.edit({AddConstraint{held(5 + i % 20, kTip - i % 3, {0, 0.01, 0})}})
             .constraint_ids[0];
    live.session.edit({RemoveConstraint{id}});
  }
  EXPECT_EQ(id, 10002u);
  const auto final = live.recorder->wait_final(20000);
  ASSERT_TRUE(final);
  EXPECT_NEAR(final->report.total_energy, energy, 1e-7 * energy);
  EXPECT_EQ(live.recorder->fault(), "");
}

}  // namespace
}  // namespace limber::session
