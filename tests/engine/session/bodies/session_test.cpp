#include "engine/session/bodies/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using scene::End;
using scene::TargetKind;
using spacetime::SolveStatus;
using test::bar_node;
using test::bent_bar;
using test::held;
using test::kCells;
using test::kInfinity;
using test::kTip;
using test::Live;
using test::Recorder;
using test::tip_at;

TEST(Session, FirstResultThenFinalForTheSceneAsOpened) {
  Live live(bent_bar());
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(live.session.state(), State::kReady);
  const auto results = live.recorder->results();
  ASSERT_GE(results.size(), 2u);
  EXPECT_FALSE(results.front()->is_final);
  EXPECT_EQ(results.front()->sequence, 1u);
  EXPECT_EQ(results.front()->revision, 0u);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_GT(final->since_edit_ms, 0);
  EXPECT_THAT(live.recorder->states(), ::testing::ElementsAre(State::kReady));
  EXPECT_THAT(live.recorder->progress(), ::testing::Not(::testing::IsEmpty()));
  EXPECT_EQ(live.recorder->fault(), "");

  const auto model = live.session.model();
  EXPECT_EQ(final->modal.rows(), model->coordinate_count());
  EXPECT_EQ(final->modal.cols(), 30);
  EXPECT_EQ(final->coordinates.rows(), final->shown->basis->cols());
  EXPECT_GE(final->coordinates.rows(), model->basis_size());
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
  EXPECT_EQ(live.session.newest_result()->coordinates, final->coordinates);
  EXPECT_EQ(live.session.final_result()->coordinates, final->coordinates);
}

TEST(Session, AnEditIsFirstCorrectedThenFinal) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_final(0);
  ASSERT_TRUE(before);
  const auto after = live.edit({MoveConstraint{1, {0, 0.12, 0.05}}});
  ASSERT_TRUE(after);
  EXPECT_EQ(after->revision, 1u);
  const auto first = live.recorder->next_solved(before->sequence);
  EXPECT_FALSE(first->is_final);
  EXPECT_EQ(first->revision, 1u);
  const double target = live.session.geometry()->rest(1, kTip) + 0.12;
  // Already the first motion goes most of the distance.
  EXPECT_LT(std::abs(tip_at(live.session, *first, 10).y() - target), 0.25 * 0.02);
  EXPECT_LT(std::abs(tip_at(live.session, *after, 10).y() - target), 0.25 * 0.02);
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
    const BodySession session("bad", scene, {}, nullptr, never, nullptr);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "constraints[1].frame");
  }
  scene = bent_bar();
  scene.mesh.tets(2, 3) = 100000;
  EXPECT_THROW(BodySession("bad", scene, {}, nullptr, never, nullptr), Error);
  EXPECT_THROW(BodySession("bad", bent_bar(), {}, nullptr, {}, nullptr), Error);
  SessionOptions options;
  options.undo_depth = -1;
  EXPECT_THROW(BodySession("bad", bent_bar(), options, nullptr, never, nullptr), Error);
}

TEST(Session, ARefusedEditLeavesEverythingAsItWas) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_checked(0);
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
    BodySession session(
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
    EXPECT_TRUE(recorder->results().back()->is_final);
    for (const char* what : {"the check", "the amendment"}) {
      ASSERT_TRUE(task) << what;
      std::exchange(task, nullptr)();
    }
    EXPECT_EQ(recorder->results().back()->check, Check::kDone);
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
  EXPECT_THAT(saved.constraints, ::testing::SizeIs(2));
  EXPECT_EQ(saved.constraints[1].id, 3u);
  EXPECT_EQ(saved.last_end, End::kPinnedPosition);
  EXPECT_EQ(saved.dynamics.damping_ratio, 0.1);
  EXPECT_EQ(saved.mesh.nodes, bent_bar().mesh.nodes);
  Live again(saved);
  const double energy = live.session.final_result()->report.total_energy;
  EXPECT_NEAR(again.recorder->wait_final(0)->report.total_energy, energy, 1e-6 * energy);
  EXPECT_THAT(again.session.edit({AddConstraint{held(3, kTip)}}).constraint_ids,
              ::testing::ElementsAre(4));
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

TEST(Session, ABaseMotionIsKeptWithoutConstraints) {
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

TEST(Session, SaysThatPartsFold) {
  scene::Scene scene = test::bar(2, 10);
  const Eigen::Index n = scene.mesh.nodes.cols(), m = scene.mesh.tets.cols();
  scene.mesh.nodes.conservativeResize(3, 2 * n);
  scene.mesh.nodes.rightCols(n) =
      scene.mesh.nodes.leftCols(n).colwise() + Eigen::Vector3d(0.2, 0.1, 0);
  scene.mesh.tets.conservativeResize(4, 2 * m);
  scene.mesh.tets.rightCols(m) = scene.mesh.tets.leftCols(m).array() + static_cast<int>(n);
  scene.merge_tolerance = 1e-6;
  Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  EXPECT_NE(live.session.state_message().find("mechanisms"), std::string::npos)
      << live.session.state_message();
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

}  // namespace
}  // namespace limber::session
