// What users do to sessions when nobody looks.

#include <fmt/format.h>
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

TEST(SessionHardCase, MillimetresAndMetresMoveAlike) {
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

TEST(SessionHardCase, AFailedSolveShowsTheOldMotionWithoutItsNumbers) {
  Live live(bent_bar());
  const auto solved = live.recorder->wait_final(0);
  ASSERT_TRUE(solved);
  ASSERT_GT(solved->report.total_energy, 0);
  const auto model = live.session.model();
  BodyResult before = *solved;
  before.mode_changes = 2;
  const BodyResult failed = failed_result(&before, *model, solved->shown, 30, "because");
  EXPECT_EQ(failed.coordinates, solved->coordinates);
  EXPECT_EQ(failed.modal, solved->modal);
  EXPECT_EQ(failed.mode_changes, 2);
  EXPECT_TRUE(failed.is_final);
  EXPECT_TRUE(failed.solve_failed);
  EXPECT_FALSE(solved->solve_failed);
  EXPECT_EQ(failed.report.status, SolveStatus::kStalled);
  EXPECT_EQ(failed.report.message, "the solve failed: because");
  for (const double number :
       {failed.report.force_energy, failed.report.constraint_energy, failed.report.total_energy,
        failed.report.gradient, failed.report.max_constraint_error,
        failed.report.rms_constraint_error, failed.report.max_exact_error})
    EXPECT_EQ(number, 0);
  EXPECT_EQ(failed.report.iterations, 0);
  EXPECT_FALSE(failed.report.rank_deficient);
  const BodyResult first = failed_result(nullptr, *model, solved->shown, 30, "because");
  EXPECT_EQ(first.coordinates, Eigen::MatrixXf::Zero(model->basis_size(), 30));
  EXPECT_EQ(first.modal, Eigen::MatrixXd::Zero(model->coordinate_count(), 30));
}

/// Meshes with fewer degrees of freedom than default modes, down to one tet with one free node.
TEST(SessionHardCase, TinyMeshesUseAsManyModesAsTheyHaveAndSaySo) {
  for (const auto variables : {scene::MaterialVariables::kMotion, scene::MaterialVariables::kAll}) {
    for (const bool is_one_tet : {true, false}) {
      scene::Scene scene = test::two_tets();
      if (is_one_tet) {
        scene.mesh.nodes = scene.mesh.nodes.leftCols(4).eval();
        scene.mesh.tets = scene.mesh.tets.leftCols(1).eval();
      }
      scene.frame_count = 40;
      scene.constraints = {held(20, 3, {0.02, 0.01, 0.03})};
      scene.material_optimisation.variables = variables;
      Live live(scene);
      const auto result = live.recorder->wait_final(0);
      ASSERT_TRUE(result) << live.session.state_message();
      EXPECT_FALSE(result->solve_failed) << result->report.message;
      const int modes = is_one_tet ? 2 : 5;
      EXPECT_EQ(result->modal.rows(), modes);
      EXPECT_EQ(live.session.state_message(),
                fmt::format("model.modes: {} used, 30 requested: the mesh has no more", modes));
    }
  }
}

TEST(SessionHardCase, ThreeFramesOneFree) {
  scene::Scene scene = test::bar(kCells, 3);
  scene.first_end = scene.last_end = End::kPinnedPosition;
  scene.constraints = {held(1, kTip, {0, 0.05, 0})};
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_GT(tip_at(live.session, *final, 1).y(), 0.1 + 0.01);
  EXPECT_TRUE(live.edit({SetEnds{End::kFree, End::kFree}, MoveConstraint{1, {0, 0.1, 0}}}));
  EXPECT_LT(live.session.final_result()->report.total_energy, final->report.total_energy);
}

TEST(SessionHardCase, AFreeBodyFollowsItsConstraintsAcrossSpace) {
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

TEST(SessionHardCase, AFreeBodyOfTwentyThousandFrames) {
  // Turns and swings besides translations: energies of 1e-9 and stiffness from 1e-12 to 1e4.
  scene::Scene scene = test::bar(kCells, 20000);
  scene.fixed_nodes.clear();
  scene.model.mode_count = 6;
  scene.model.tolerance = 0.05;
  Random random(17);
  for (int i = 1; i <= 8; ++i) {
    scene.constraints.push_back(
        held(2400 * i, test::below(random, 20),
             {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)}));
    if (i % 2 == 0) scene.constraints.back().weight = kInfinity;
  }
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_LT(result->report.max_constraint_error, 1e-6);
  EXPECT_LT(result->report.total_energy, 1e-6);
  EXPECT_TRUE(result->coordinates.allFinite());
}

TEST(SessionHardCase, ContradictingExactConstraintsGetALeastSquaresAnswer) {
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

TEST(SessionHardCase, AddingAndRemovingTenThousandTimesLeavesTheStateWhereItWas) {
  scene::Scene scene = test::bar(3, 16);
  scene.model.mode_count = 4;
  scene.model.basis_size = 8;
  scene.model.cubature_size = 4;
  const int tip = bar_node(3, 3, 1, 2);
  scene.constraints = {held(8, tip, {0, 0.05, 0.02})};
  const auto inline_executor = [](const std::function<void()>& task) { task(); };
  BodySession session("in and out", scene, {}, test::shared_cache(), inline_executor, nullptr);
  const auto opened = session.final_result();
  std::uint64_t id = 0;
  for (int i = 0; i < 10000; ++i) {  // each is solved before the next
    scene::Constraint other = held(3 + i % 10, tip - i % 3, {0, 0.01, 0});
    if (i % 2 == 0) other.weight = kInfinity;
    id = session.edit({AddConstraint{other}}).constraint_ids[0];
    session.edit({RemoveConstraint{id}});
  }
  EXPECT_EQ(id, 10001u);
  const auto final = session.final_result();
  EXPECT_EQ(final->revision, 20000u);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_NEAR(final->report.total_energy, opened->report.total_energy,
              1e-8 * opened->report.total_energy);
  EXPECT_LT((final->modal - opened->modal).norm(), 1e-6 * opened->modal.norm());
}

/// Mostly moves of the first two constraints; now and then anything else.
BodyEdit any_edit(Random& random, std::uint64_t newest_id) {
  const Eigen::Vector3d target(0, random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1));
  switch (test::below(random, 16)) {
    case 0: {
      const scene::Constraint added =
          held(3 + test::below(random, 24), kTip - test::below(random, 3), target);
      return AddConstraint{added};
    }
    case 1:
      return RemoveConstraint{3 + random.index(newest_id)};
    case 2:
      return Undo{};
    case 3:
      return Redo{};
    case 4:
      return SetDynamics{{30, random.uniform(15, 30), random.uniform(0, 0.1)}};
    case 5:
      return MoveConstraint{1 + random.index(newest_id), target};
    default:
      return MoveConstraint{1 + random.index(2), target};
  }
}

TEST(SessionHardCase, AHundredThousandRandomEditsEndAtAColdSolve) {
  SessionOptions options;
  options.max_constraints = 8;
  Live live(bent_bar(), options);
  Random random(100000);
  Revision accepted = 0;
  std::uint64_t newest_id = 2;
  for (int i = 0; i < 100000; ++i) {
    try {
      const EditReceipt receipt = live.session.edit({any_edit(random, newest_id)});
      newest_id = std::max(newest_id, receipt.constraint_ids[0]);
      ++accepted;
    } catch (const Error& error) {  // no such constraint, nothing to undo, too many constraints
      ASSERT_THAT(error.code(),
                  ::testing::AnyOf(ErrorCode::kNotFound, ErrorCode::kFailedPrecondition,
                                   ErrorCode::kLimitExceeded))
          << error.what();
    }
    if (i % 500 == 0) {
      ASSERT_TRUE(live.recorder->wait_final(accepted));
    }
  }
  EXPECT_GT(accepted, 70000u);
  EXPECT_EQ(live.session.revision(), accepted);
  const auto final = live.recorder->wait_final(accepted);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_EQ(live.recorder->fault(), "");
  const auto fresh = test::solve_fresh(live.session.scene(), test::shared_cache());
  EXPECT_GT(fresh->report.total_energy, 1e-9);
  EXPECT_NEAR(final->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy);
}

TEST(SessionHardCase, TargetsTenBodyLengthsAway) {
  Live live(bent_bar());
  const auto far = live.edit({MoveConstraint{1, {0, 6, 0}}, MoveConstraint{2, {6, -6, 6}}});
  ASSERT_TRUE(far);
  EXPECT_GT(far->report.max_constraint_error, 1e-3);  // it is soft, and far
  EXPECT_EQ(live.recorder->fault(), "");
  // And back, as if nothing had happened.
  const double opened = test::solve_fresh(bent_bar(), test::shared_cache())->report.total_energy;
  const auto back = live.edit({Undo{}});
  ASSERT_TRUE(back);
  EXPECT_EQ(back->report.status, SolveStatus::kConverged) << back->report.message;
  EXPECT_LE(back->report.total_energy, (1 + 1e-6) * opened);
}

TEST(SessionHardCase, ExactConstraintOnAFixedNode) {
  scene::Scene scene = bent_bar();
  const auto before = test::solve_fresh(scene, test::shared_cache());
  Live live(scene);
  scene::Constraint stuck = held(10, scene.fixed_nodes.front(), {0, 0.5, 0});
  stuck.weight = kInfinity;
  const auto answer = live.edit({AddConstraint{stuck}});
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->report.status, SolveStatus::kConverged) << answer->report.message;
  EXPECT_TRUE(answer->report.rank_deficient);
  EXPECT_NEAR(answer->report.max_exact_error, 0.5, 1e-6);
  EXPECT_THAT(answer->report.message, ::testing::HasSubstr("fixed nodes"));
  // All else continues as without it.
  EXPECT_NEAR(answer->report.total_energy, before->report.total_energy,
              1e-6 * before->report.total_energy);
}

TEST(SessionHardCase, WeightsFromFeatherToLead) {
  Live live(bent_bar());
  for (const double weight : {1e-30, 1e-6, 1e9, 1e12}) {
    scene::Constraint constraint = live.session.constraints()[0];
    constraint.weight = weight;
    const auto final = live.edit({ReplaceConstraint{constraint}});
    ASSERT_TRUE(final);
    EXPECT_TRUE(std::isfinite(final->report.total_energy)) << weight;
    const double off = std::abs(tip_at(live.session, *final, 10).y() - (0.1 + 0.1));
    if (weight < 1) {
      EXPECT_GT(off, 0.02) << weight;
    } else {
      EXPECT_LT(off, 1e-5) << weight;
    }
  }
  EXPECT_EQ(live.recorder->fault(), "");
}

}  // namespace
}  // namespace limber::session
