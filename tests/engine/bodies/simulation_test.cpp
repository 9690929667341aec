#include "engine/bodies/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using ::testing::HasSubstr;
using testing::Hold;
using testing::slender_beam;

std::vector<int> tip(const ElasticBody& body) {
  std::vector<int> nodes;
  for (int a = 0; a < body.mesh.node_count(); ++a) {
    if (body.mesh.nodes(0, a) > 0.59) nodes.push_back(a);
  }
  return nodes;
}

SimulationOptions seconds(double time, double frames_per_second = 50) {
  SimulationOptions options;
  options.frames_per_second = frames_per_second;
  options.frame_count = static_cast<int>(time * frames_per_second) + 1;
  return options;
}

std::string field_of(const ElasticBody& body, const Loads& loads,
                     const SimulationOptions& options) {
  try {
    (void)simulate(body, loads, {}, options);
  } catch (const Error& error) {
    return error.field();
  }
  return "accepted";
}

TEST(Simulation, EnergyOfALoadedBeamIsTheWorkOfItsLoads) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  Loads loads;
  loads.gravity = {0, 0, -9.81};
  SimulationOptions options = seconds(0.5);
  options.steps_per_frame = 20;
  const Simulation result = simulate(body, loads, {}, options);
  const FullDynamics dynamics(body, {});
  const Eigen::VectorXd weight =
      dynamics.mass() * loads.gravity.replicate(body.mesh.node_count(), 1);
  double largest = 0;
  for (int frame = 0; frame < options.frame_count; ++frame) {
    const double work = weight.dot(result.displacements.col(frame));
    largest = std::max(largest, work);
    EXPECT_NEAR(result.kinetic[frame] + result.elastic[frame], work,
                2e-3 * std::max(largest, 1e-6));
  }
  EXPECT_GT(largest, 0.1);
  EXPECT_EQ(result.steps, 500);
  EXPECT_EQ(result.shortened_steps, 0);
  EXPECT_TRUE(result.message.empty());
}

TEST(Simulation, AForceActsWhileItActsHoweverShort) {
  // A free body: momentum is force times time, whether the steps see the blow's ends or not.
  const ElasticBody body = slender_beam(Hold::kFree);
  Loads loads;
  loads.forces = {{tip(body), {0, 0, 2}, 0.0301, 0.0342}};
  const Simulation result = simulate(body, loads, {}, seconds(0.2));
  const FullDynamics dynamics(body, {});
  const Eigen::VectorXd momentum = dynamics.mass() *
                                   (result.displacements.rightCols<1>() -
                                    result.displacements.col(result.displacements.cols() - 2)) *
                                   50;
  double along = 0;
  for (int a = 0; a < body.mesh.node_count(); ++a) along += momentum[3 * a + 2];
  EXPECT_NEAR(along, 2 * 0.0041, 1e-7);
}

/// Momentum along z of a free beam after 0.2 s of this force [kg m/s].
double momentum_after(const PointForce& force) {
  const ElasticBody body = slender_beam(Hold::kFree);
  Loads loads;
  loads.forces = {force};
  const Simulation result = simulate(body, loads, {}, seconds(0.2));
  const Eigen::Index last = result.displacements.cols() - 1;
  const Eigen::VectorXd momentum =
      FullDynamics(body, {}).mass() *
      (result.displacements.col(last) - result.displacements.col(last - 1)) * 50;
  double along = 0;
  for (int a = 0; a < body.mesh.node_count(); ++a) along += momentum[3 * a + 2];
  return along;
}

TEST(Simulation, ProfilesGiveTheImpulseOfTheirIntegral) {
  // None of the times is one of a step.
  const std::vector<int> nodes = tip(slender_beam(Hold::kFree));
  const PointForce ramp{nodes, {0, 0, 2}, 0.0103, 0.1507, ForceProfile::kRamp};
  EXPECT_NEAR(momentum_after(ramp), 2 * 0.5 * (0.1507 - 0.0103), 1e-7);
  const double period = 0.0877;
  const PointForce sine{nodes, {0, 0, 2}, 0.0103, 0.1507, ForceProfile::kSine, period};
  const double turn = 2 * EIGEN_PI / period;
  EXPECT_NEAR(momentum_after(sine), 2 * (1 - std::cos(turn * (0.1507 - 0.0103))) / turn, 1e-7);
}

TEST(Simulation, WorkOfTheLoadsIsTheEnergyOfTheBody) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  Loads loads;
  loads.gravity = {0, 0, -9.81};
  loads.forces = {{tip(body), {0, 1, 0}, 0.03, 0.25, ForceProfile::kSine, 0.1}};
  SimulationOptions options = seconds(0.4);
  options.steps_per_frame = 20;
  const Simulation result = simulate(body, loads, {}, options);
  const Eigen::VectorXd energy = result.kinetic + result.elastic;
  EXPECT_GT(energy.maxCoeff(), 0.02);
  EXPECT_LT((energy - result.work).cwiseAbs().maxCoeff(), 2e-3 * energy.maxCoeff());
  EXPECT_EQ(result.work[0], 0);
}

TEST(Simulation, ACrushingBlowIsTakenInShorterStepsAndReported) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  Loads loads;
  loads.forces = {{tip(body), {-500, 0, 0}, 0, 0.2}};
  SimulationOptions options = seconds(0.5);
  options.steps_per_frame = 1;
  const Simulation result = simulate(body, loads, {}, options);
  EXPECT_GT(result.shortened_steps, 0);
  EXPECT_TRUE(result.displacements.allFinite());
  EXPECT_LT(result.smallest_volume_ratio, 0);
  EXPECT_THAT(result.message, HasSubstr("inside out"));
}

TEST(Simulation, IsTheSameTwiceOver) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  Loads loads;
  loads.gravity = {1, 2, -9.81};
  const auto once = simulate(body, loads, {}, seconds(0.1));
  const auto again = simulate(body, loads, {}, seconds(0.1));
  EXPECT_EQ(once.displacements, again.displacements);
}

TEST(Simulation, CanBeCancelled) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  JobContext job;
  job.progress = [&](const std::string&, double fraction) {
    if (fraction > 0.3) job.cancellation.request();
  };
  EXPECT_THROW((void)simulate(body, {}, {}, seconds(1), job), Error);
}

TEST(Simulation, RefusesBadInputByField) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  Loads loads;
  EXPECT_EQ(field_of(body, loads, {}), "frame_count");
  SimulationOptions options = seconds(0.1);
  options.steps_per_frame = 0;
  EXPECT_EQ(field_of(body, loads, options), "steps_per_frame");
  options = seconds(0.1);
  options.dynamics.mass_damping = -1;
  EXPECT_EQ(field_of(body, loads, options), "mass_damping");
  options = seconds(0.1);
  loads.gravity[1] = NAN;
  EXPECT_EQ(field_of(body, loads, options), "gravity");
  loads = {};
  loads.forces = {{{0}, {1, 0, 0}, 0, 1}, {{9999}, {1, 0, 0}, 0, 1}};
  EXPECT_EQ(field_of(body, loads, options), "forces[1].nodes");
  loads.forces = {{{0}, {1, 0, 0}, 1, 1}};
  EXPECT_EQ(field_of(body, loads, options), "forces[0].until");
  loads.forces = {{{0}, {1, 0, 0}, 0, INFINITY, ForceProfile::kRamp}};
  EXPECT_EQ(field_of(body, loads, options), "forces[0].until");
  loads.forces = {{{0}, {1, 0, 0}, 0, 1, ForceProfile::kSine, 0}};
  EXPECT_EQ(field_of(body, loads, options), "forces[0].period");
  loads.forces = {{{}, {1, 0, 0}, 0, 1}};
  EXPECT_EQ(field_of(body, loads, options), "forces[0].nodes");
}

}  // namespace
}  // namespace limber::bodies
