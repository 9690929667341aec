#include "engine/session/bodies/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/session/bodies/geometry.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using ::testing::HasSubstr;

scene::Scene pushed_bar() {
  scene::Scene scene = test::bar(4, 12);
  scene.simulation.emplace();
  scene.simulation->forces = {{{test::bar_node(4, 4, 0, 0)}, {0, 0.5, 1}, 0, 6}};
  scene.simulation->steps_per_frame = 2;
  return scene;
}

Eigen::MatrixXd moved_nodes(const scene::Scene& scene, const SimulatedMotion& motion) {
  return with_base_motion(scene, motion.positions).base_motion;
}

TEST(SceneSimulation, TheUnitOfLengthDoesNotMatter) {
  const scene::Scene metres = pushed_bar();
  scene::Scene millimetres = metres;
  millimetres.length_unit_in_metres = 0.001;
  millimetres.mesh.nodes *= 1000;
  const Eigen::MatrixXd u = moved_nodes(metres, simulate(metres));
  const Eigen::MatrixXd v = moved_nodes(millimetres, simulate(millimetres));
  EXPECT_GT(u.cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((v / 1000 - u).cwiseAbs().maxCoeff(), 1e-6 * u.cwiseAbs().maxCoeff() + 1e-7);
}

TEST(SceneSimulation, UnusedNodesRestAndFixedOnesToo) {
  scene::Scene scene = test::two_tets();
  scene.simulation.emplace();
  scene.simulation->gravity = {0, -9.81, 0};
  scene.fixed_nodes = {0, 1};
  scene.simulation->initial.common_velocity = {1, 0, 0};
  const SimulatedMotion motion = simulate(scene);
  const Eigen::MatrixXd u = moved_nodes(scene, motion);
  ASSERT_EQ(u.rows(), 18);
  for (const int node : {0, 1, 5}) EXPECT_TRUE(u.middleRows(3 * node, 3).isZero(1e-6)) << node;
  EXPECT_GT(u.middleRows(9, 3).norm(), 0.01);
}

TEST(SceneSimulation, ModesOfTheInitialStateAreAmplitudes) {
  scene::Scene scene = pushed_bar();
  scene.simulation->forces.clear();
  scene.length_unit_in_metres = 0.01;
  scene.mesh.nodes *= 100;
  scene.simulation->initial.modes = {0, 0.3};
  const SimulatedMotion motion = simulate(scene);
  const Eigen::VectorXd start = moved_nodes(scene, motion).col(0);
  EXPECT_NEAR(start.reshaped(3, start.size() / 3).colwise().norm().maxCoeff(), 0.3, 1e-5);
  Eigen::Index at = 0;
  start.cwiseAbs().maxCoeff(&at);
  EXPECT_GT(start[at], 0);
  // Released, it swings: energy is kept and changes its kind.
  EXPECT_LT(motion.report.energy_drift, 0.02);
  EXPECT_GT(motion.report.kinetic.maxCoeff(), 0.3 * motion.report.elastic[0]);
}

TEST(SceneSimulation, DampingTakesEnergyAndTheReportSaysHowMuch) {
  scene::Scene scene = pushed_bar();
  const double undamped = simulate(scene).report.energy_drift;
  scene.simulation->mass_damping = 5;
  const SimulationReport damped = simulate(scene).report;
  EXPECT_GT(damped.energy_drift, 10 * undamped);
  EXPECT_LT(damped.kinetic[11] + damped.elastic[11], damped.work[11]);
  EXPECT_EQ(damped.steps, 22);
  EXPECT_EQ(damped.frames_per_second, 30);
}

TEST(SceneSimulation, FramesPerSecondAreTheSimulationsOwnIfItHasSome) {
  // Twice as fast a camera with twice as many frames for the same push sees the same motion.
  scene::Scene slow = pushed_bar();
  scene::Scene fast = slow;
  fast.frame_count = 23;
  fast.simulation->frames_per_second = 60;
  fast.simulation->steps_per_frame = 1;
  fast.simulation->forces[0].until_frame = 12;
  const Eigen::MatrixXd u = moved_nodes(slow, simulate(slow));
  const Eigen::MatrixXd v = moved_nodes(fast, simulate(fast));
  EXPECT_LT((v.col(22) - u.col(11)).norm(), 1e-5 * u.col(11).norm());
}

TEST(SceneSimulation, RefusalsNameTheField) {
  scene::Scene scene = pushed_bar();
  const auto field = [&] {
    try {
      (void)simulate(scene);
    } catch (const Error& error) {
      return error.field() + ": " + error.what();
    }
    return std::string("accepted");
  };
  scene.simulation->forces[0].force *= 1e200;  // beyond what numbers can say
  EXPECT_THAT(field(), HasSubstr("simulation: the simulation fails at"));
  scene.simulation.reset();
  EXPECT_THAT(field(), HasSubstr("simulation: the scene says nothing to simulate"));
}

TEST(SceneSimulation, CanBeCancelled) {
  JobContext job;
  job.progress = [&](const std::string&, double fraction) {
    if (fraction > 0.3) job.cancellation.request();
  };
  try {
    (void)simulate(pushed_bar(), job);
    FAIL() << "ran to its end";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace limber::session
