// Sessions of structures of beams with a real limberd.

#include "clients/cpp/beams/session.h"

#include <gmock/gmock.h>

#include "clients/cpp/array_numbers.h"
#include "tests/server/process/child_process.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

/// 1 m along x, EI = 1 N m^2, clamped at node 0, 1 N down at node 20: bends by 0.30172 (elastica).
v1::Scene cantilever() {
  v1::Scene scene;
  auto& structure = *scene.mutable_beams()->mutable_structure();
  for (int i = 0; i <= 20; ++i)
    structure.add_nodes()->mutable_position()->set_x(static_cast<double>(i) / 20);
  auto& section = *structure.add_sections();
  section.mutable_rectangle()->set_width(0.01);
  section.mutable_rectangle()->set_height(0.01);
  section.set_young(12e8);
  section.set_poisson(0.3);
  for (unsigned i = 0; i < 20; ++i) {
    auto& element = *structure.add_elements();
    element.set_start(i);
    element.set_finish(i + 1);
  }
  auto& support = *structure.add_supports();
  support.set_fix_x(true);
  support.set_fix_y(true);
  support.set_fix_z(true);
  support.set_fix_rotation_x(true);
  support.set_fix_rotation_y(true);
  support.set_fix_rotation_z(true);
  auto& load = *structure.add_loads();
  load.set_node(20);
  load.mutable_force()->set_z(-1);
  return scene;
}

double height_of_tip(BeamSession& session) {
  const Positions positions = session.positions();
  EXPECT_EQ(positions.nodes, 21U);
  return positions.values.back();
}

struct BeamClient : ::testing::Test {
  const limber::TemporaryFolder folder;
  const server::testing::Daemon daemon{folder.path()};
  Client client{daemon.requests};
};

TEST_F(BeamClient, FinalResultsAreFollowedByTheirError) {
  v1::Scene scene = cantilever();
  BeamSession arm = BeamSession::open(client, scene, "arm");
  const v1::ResultInfo checked = arm.wait_checked();
  ASSERT_TRUE(checked.has_discretisation_error());
  EXPECT_EQ(checked.discretisation_error().elements(), 20U);
  EXPECT_EQ(checked.discretisation_error().compared_elements(), 40U);
  scene.mutable_beams()->set_elements_per_member(2);
  BeamSession finer = BeamSession::open(client, scene, "finer");
  EXPECT_EQ(finer.wait_checked().discretisation_error().elements(), 40U);
  EXPECT_EQ(finer.positions().nodes, 21U);
}

TEST_F(BeamClient, SupportsMoveAndLoadsChange) {
  BeamSession arm = BeamSession::open(client, cantilever(), "arm");
  EXPECT_EQ(arm.status().beam_nodes(), 21U);
  EXPECT_NEAR(height_of_tip(arm), -0.30172, 1e-4);
  arm.load(20, {0, 0, -10});
  const v1::ResultInfo loaded = arm.wait();
  EXPECT_EQ(loaded.status(), v1::SOLVE_STATUS_CONVERGED) << loaded.message();
  EXPECT_GT(loaded.beams().steps(), 2U);
  EXPECT_NEAR(height_of_tip(arm), -0.81061, 1e-4);
  BeamMove up;
  up.z = 0.5;
  arm.move_support(0, up);
  arm.wait();
  EXPECT_NEAR(height_of_tip(arm), 0.5 - 0.81061, 1e-4);
  EXPECT_EQ(arm.structure().motions_size(), 1);
  arm.hold(20);
  arm.wait();
  arm.load(20, {0, 0, 0});
  arm.wait();
  EXPECT_NEAR(height_of_tip(arm), 0.5 - 0.81061, 1e-4);
  const auto reactions =
      numbers<double>(arm.solution().reaction_forces(), v1::DATA_TYPE_FLOAT64, 2, "reactions");
  EXPECT_LT(reactions[3 * 20 + 2], -5) << "what holds the tip bears what the load bore";
  arm.release(20);
  arm.wait();
  EXPECT_NEAR(height_of_tip(arm), 0.5, 1e-5);
  EXPECT_EQ(arm.undo().revision(), 6U);
  arm.close();
  EXPECT_THROW(arm.status(), ClientError);
}

TEST_F(BeamClient, LoadsFollowAndPushesPass) {
  BeamSession arm = BeamSession::open(client, cantilever(), "arm");
  arm.load(20, {0, 0, -10}, {}, LoadDirection::kFollows);
  arm.wait();
  EXPECT_TRUE(arm.structure().loads(0).follows());
  EXPECT_LT(height_of_tip(arm), -0.1);
  arm.load(20, {0, 0, -1});
  arm.element_load(19, {0, 0, -1}, LoadDirection::kFollows);
  EXPECT_TRUE(arm.structure().distributed_loads(0).follows());
  arm.element_load(19, {0, 0, 0});
  arm.push(20, {0, 0, 1});
  arm.wait();
  EXPECT_NEAR(height_of_tip(arm), -0.30172, 1e-4) << "what pushed is gone";
  BeamMove to;
  to.position = Vector{0, 0, 0.25};
  arm.move_support(0, to);
  arm.wait();
  EXPECT_NEAR(height_of_tip(arm), 0.25 - 0.30172, 1e-4);
}

TEST_F(BeamClient, RefusalsNameTheEdit) {
  BeamSession arm = BeamSession::open(client, cantilever());
  try {
    arm.release(0);
    FAIL() << "accepted";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), v1::ERROR_CODE_FAILED_PRECONDITION);
    EXPECT_EQ(error.field(), "edits[0].release_beam_node");
  }
  EXPECT_EQ(arm.status().revision(), 0U);
  v1::Scene loose = cantilever();
  loose.mutable_beams()->mutable_structure()->clear_supports();
  EXPECT_THROW(BeamSession::open(client, loose), ClientError);
}

}  // namespace
}  // namespace limber::client
