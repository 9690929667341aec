#include "engine/scene/simulation_validation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/scene/samples/samples.h"
#include "tests/engine/scene/not_finite.h"

namespace limber::scene {
namespace {

using testing::kInfinity;
using testing::kNan;

/// 150 frames, 1377 nodes, held at node 0.
Scene simulated_beam() {
  Scene scene = make_sample("beam");
  Simulation simulation;
  simulation.gravity = {0, -9.81, 0};
  simulation.forces = {{{1336, 1335}, {0, 1, 0}, 0, 30},
                       {{1336}, {0, 1, 0}, 5, 30, bodies::ForceProfile::kSine, 12}};
  simulation.initial.modes = {0.1, 0.2};
  scene.simulation = simulation;
  return scene;
}

struct SimulationFault {
  const char* field;
  std::function<void(Simulation&)> make;
  Issue::Severity severity = Issue::Severity::kError;
  ErrorCode code = ErrorCode::kInvalidArgument;
};

TEST(SimulationValidation, AGoodOneHasNoIssues) {
  EXPECT_TRUE(validate(simulated_beam()).empty());
  Scene without = simulated_beam();
  without.simulation.reset();
  EXPECT_TRUE(simulation_issues(without).empty());
}

TEST(SimulationValidation, EachFaultIsNamedAloneWithItsField) {
  const int fixed = simulated_beam().fixed_nodes.front();
  const SimulationFault faults[] = {
      {"simulation.gravity", [](Simulation& s) { s.gravity[1] = kNan; }},
      {"simulation.forces[1].nodes", [](Simulation& s) { s.forces[1].nodes.clear(); }},
      {"simulation.forces[1].nodes[0]", [](Simulation& s) { s.forces[1].nodes = {1377}; },
       Issue::Severity::kError, ErrorCode::kOutOfRange},
      {"simulation.forces[0].nodes[1]",
       [](Simulation& s) {
         s.forces[0].nodes = {5, 5};
       }},
      {"simulation.forces[0].nodes", [&](Simulation& s) { s.forces[0].nodes = {fixed}; },
       Issue::Severity::kWarning},
      {"simulation.forces[0].force", [](Simulation& s) { s.forces[0].force[2] = kInfinity; }},
      {"simulation.forces[0].from_frame", [](Simulation& s) { s.forces[0].from_frame = -1; }},
      {"simulation.forces[0].until_frame", [](Simulation& s) { s.forces[0].until_frame = 0; }},
      {"simulation.forces[0].until_frame", [](Simulation& s) { s.forces[0].until_frame = kNan; }},
      {"simulation.forces[0].from_frame",
       [](Simulation& s) {
         s.forces[0].from_frame = 149;
         s.forces[0].until_frame = 160;
       },
       Issue::Severity::kWarning},
      {"simulation.forces[1].period_frames", [](Simulation& s) { s.forces[1].period_frames = 0; }},
      {"simulation.forces[0].period_frames", [](Simulation& s) { s.forces[0].period_frames = 3; }},
      {"simulation.initial.displacements",
       [](Simulation& s) { s.initial.displacement = Eigen::VectorXd::Zero(12); }},
      {"simulation.initial.velocities",
       [](Simulation& s) {
         s.initial.velocity = Eigen::VectorXd::Zero(3 * 1377);
         s.initial.velocity[7] = kNan;
       }},
      {"simulation.initial.displacements",
       [&](Simulation& s) {
         s.initial.displacement = Eigen::VectorXd::Zero(3 * 1377);
         s.initial.displacement[3 * fixed + 1] = 1e-9;
       }},
      {"simulation.initial.velocity", [](Simulation& s) { s.initial.common_velocity[0] = kNan; }},
      {"simulation.initial.modes[1]", [](Simulation& s) { s.initial.modes[1] = kInfinity; }},
      {"simulation.initial.modes", [](Simulation& s) { s.initial.modes.resize(3 * 1377); }},
      {"simulation.frames_per_second", [](Simulation& s) { s.frames_per_second = 0; }},
      {"simulation.steps_per_frame", [](Simulation& s) { s.steps_per_frame = 0; }},
      {"simulation.steps_per_frame", [](Simulation& s) { s.steps_per_frame = 10'001; }},
      {"simulation.mass_damping", [](Simulation& s) { s.mass_damping = -1; }},
      {"simulation.relaxation_time", [](Simulation& s) { s.relaxation_time = kInfinity; }},
  };
  for (const SimulationFault& fault : faults) {
    Scene scene = simulated_beam();
    fault.make(*scene.simulation);
    const std::vector<Issue> issues = simulation_issues(scene);
    ASSERT_EQ(issues.size(), 1u) << fault.field;
    EXPECT_EQ(issues[0].field, fault.field) << issues[0].message;
    EXPECT_EQ(issues[0].severity, fault.severity) << fault.field;
    EXPECT_EQ(issues[0].code, fault.code) << fault.field;
  }
}

TEST(SimulationValidation, AllFaultsAreListedWithThoseOfTheScene) {
  Scene scene = simulated_beam();
  scene.dynamics.frames_per_second = 0;
  scene.simulation->steps_per_frame = 0;
  scene.simulation->forces[1].nodes = {-1};
  std::vector<std::string> fields;
  for (const Issue& issue : validate(scene)) fields.push_back(issue.field);
  const std::vector<std::string> wanted = {
      "dynamics.frames_per_second", "simulation.forces[1].nodes[0]", "simulation.steps_per_frame"};
  EXPECT_EQ(fields, wanted);
}

}  // namespace
}  // namespace limber::scene
