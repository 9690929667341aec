#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using scene::MaterialVariables;
using spacetime::SolveStatus;
using test::bent_bar;
using test::held;
using test::Live;
using test::tip_at;

scene::Scene swinging_bar(MaterialVariables variables) {
  scene::Scene scene = bent_bar();
  scene.material_optimisation.variables = variables;
  scene.model.candidate_modes = 2 * scene.model.mode_count;
  return scene;
}

bool same(const spacetime::Material& a, const spacetime::Material& b) {
  return a.mixing == b.mixing && a.dynamics.stiffness == b.dynamics.stiffness &&
         a.dynamics.damping == b.dynamics.damping;
}

TEST(SessionMaterial, ForcesAloneComeFirstThenTheMaterialAsItIsFitted) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  const auto results = live.recorder->results();
  double z_only = 0;
  int fitted = 0;
  for (const auto& result : results) {
    if (result->material_iterations == 0) {
      EXPECT_TRUE(same(*result->material, *result->initial_material));
      z_only = result->report.total_energy;
      EXPECT_EQ(fitted, 0) << "forces alone come first";
    } else {
      ++fitted;
      EXPECT_LT(result->report.total_energy, z_only);
    }
  }
  EXPECT_GT(fitted, 1);
  EXPECT_GT(final->material_iterations, 0);
  EXPECT_FALSE(same(*final->material, *final->initial_material));
  EXPECT_LT(final->report.total_energy, 0.5 * z_only);
  EXPECT_LT(final->unit_force_energy, 0.5 * results.front()->unit_force_energy + z_only);
  // r modes that mix twice as many coordinates; the frames are those of S z.
  const auto model = live.session.model();
  EXPECT_EQ(final->modal.rows(), final->material->modes());
  EXPECT_EQ(final->material->coordinates(), model->coordinate_count());
  EXPECT_EQ(model->coordinate_count(), 2 * final->material->modes());
  const Eigen::Vector3d rest = live.session.geometry()->rest.col(test::kTip);
  const double error =
      (tip_at(live.session, *final, 10) - rest - Eigen::Vector3d(0, 0.1, 0.05)).norm();
  EXPECT_LT(error, final->report.max_constraint_error + 1e-5);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionMaterial, DynamicsAloneLeaveTheModesAlone) {
  Live live(swinging_bar(MaterialVariables::kDynamics));
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->material->mixing, final->initial_material->mixing);
  EXPECT_FALSE(final->material->dynamics.stiffness == final->initial_material->dynamics.stiffness);
}

TEST(SessionMaterial, FreezingKeepsWhatWasFittedAndResettingForgetsIt) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto fitted = live.recorder->wait_final(0);
  ASSERT_TRUE(fitted);
  const auto frozen = live.edit({SetMaterialVariables{MaterialVariables::kMotion}});
  ASSERT_TRUE(frozen);
  EXPECT_TRUE(same(*frozen->material, *fitted->material));
  EXPECT_EQ(frozen->material_iterations, 0);
  EXPECT_NEAR(frozen->report.total_energy, fitted->report.total_energy,
              1e-6 * fitted->report.total_energy);
  // A frozen material stays what it is under further edits.
  const auto moved = live.edit({MoveConstraint{1, {0, 0.12, 0.05}}});
  ASSERT_TRUE(moved);
  EXPECT_TRUE(same(*moved->material, *fitted->material));
  const auto reset = live.edit({ResetMaterial{}});
  ASSERT_TRUE(reset);
  EXPECT_TRUE(same(*reset->material, *reset->initial_material));
  EXPECT_GT(reset->report.total_energy, moved->report.total_energy);
  // Undo brings back material and motion.
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_TRUE(same(*undone->material, *fitted->material));
  EXPECT_NEAR(undone->report.total_energy, moved->report.total_energy,
              1e-6 * moved->report.total_energy);
}

TEST(SessionMaterial, OtherDynamicsStartTheMaterialAnew) {
  Live live(swinging_bar(MaterialVariables::kAll));
  ASSERT_TRUE(live.recorder->wait_final(0));
  live.edit({SetMaterialVariables{MaterialVariables::kMotion}});
  scene::Dynamics dynamics = live.session.dynamics();
  dynamics.period_frames /= 2;
  const auto result = live.edit({SetDynamics{testing::requested(dynamics)}});
  ASSERT_TRUE(result);
  EXPECT_TRUE(same(*result->material, *result->initial_material));
  EXPECT_NEAR(result->material->dynamics.stiffness[0],
              std::pow(2 * 3.14159265358979 / dynamics.period_frames, 2), 1e-9);
}

TEST(SessionMaterial, AnotherFrameRateLeavesTheMaterialAlone) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto fitted = live.recorder->wait_final(0);
  ASSERT_TRUE(fitted);
  live.edit({SetMaterialVariables{MaterialVariables::kMotion}});
  scene::Dynamics dynamics = live.session.dynamics();
  dynamics.frames_per_second *= 2;  // the period is in frames
  const auto result = live.edit({SetDynamics{testing::requested(dynamics)}});
  ASSERT_TRUE(result);
  EXPECT_TRUE(same(*result->material, *fitted->material));
}

TEST(SessionMaterial, AColdSolveLeavesAFrozenMaterialAlone) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto fitted = live.recorder->wait_final(0);
  ASSERT_TRUE(fitted);
  live.edit({SetMaterialVariables{MaterialVariables::kMotion}});
  const auto moved = live.edit({MoveConstraint{1, {0, -0.05, 0.1}}});
  ASSERT_TRUE(moved);
  live.session.solve_cold(3);
  const auto cold = live.recorder->wait_final(2, moved->sequence);
  ASSERT_TRUE(cold);
  EXPECT_TRUE(same(*cold->material, *fitted->material));
}

TEST(SessionMaterial, UndoingAResetBringsTheMaterialBackAlsoWhereNoAnswerWasKept) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto fitted = live.recorder->wait_final(0);
  ASSERT_TRUE(fitted);
  live.edit({SetMaterialVariables{MaterialVariables::kMotion}});
  live.session.edit({MoveConstraint{1, {0, -0.05, 0.1}}});  // perhaps never solved
  live.edit({ResetMaterial{}});
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_TRUE(same(*undone->material, *fitted->material));
}

TEST(SessionMaterial, EditsWhileItIsFittedWinAndContinueFromWhatIsThere) {
  Live live(swinging_bar(MaterialVariables::kAll));
  ASSERT_TRUE(live.recorder->wait_final(0));
  for (int i = 0; i < 30; ++i) live.session.edit({MoveConstraint{1, {0, 0.1 + 0.001 * i, 0.05}}});
  const auto final = live.recorder->wait_final(30);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->revision, 30u);
  EXPECT_FALSE(same(*final->material, *final->initial_material));
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionMaterial, AColdSolveStartsFromTheScenesMaterialAndKeepsTheBetterAnswer) {
  Live live(swinging_bar(MaterialVariables::kAll));
  const auto before = live.recorder->wait_final(0);
  ASSERT_TRUE(before);
  live.session.solve_cold(7);
  const auto after = live.recorder->wait_final(0, before->sequence);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->cold_request, 7u);
  EXPECT_LE(after->report.total_energy, before->report.total_energy * (1 + 1e-9));
}

TEST(SessionMaterial, AFreeBodyKeepsItsRigidMotions) {
  scene::Scene scene = swinging_bar(MaterialVariables::kAll);
  scene.fixed_nodes.clear();
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  const spacetime::Material& material = *final->material;
  EXPECT_EQ(material.modes(), scene.model.mode_count + 6);
  EXPECT_TRUE(material.dynamics.stiffness.head(6).isZero(0));
  EXPECT_TRUE(material.dynamics.damping.head(6).isZero(0));
  EXPECT_TRUE(material.mixing.topLeftCorner(6, 6).isIdentity(0));
  EXPECT_TRUE(material.mixing.topRightCorner(6, scene.model.mode_count).isZero(0));
  EXPECT_TRUE(final->modal.allFinite());
}

TEST(SessionMaterial, NothingToMeetIsAnAnswerAtOnce) {
  scene::Scene scene = swinging_bar(MaterialVariables::kAll);
  scene.constraints.clear();
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  EXPECT_TRUE(final->modal.isZero(0));
  EXPECT_TRUE(same(*final->material, *final->initial_material));
}

}  // namespace
}  // namespace limber::session
