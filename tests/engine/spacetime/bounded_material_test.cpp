// Bounds of fitted frequencies: MaterialOptions::max_frequency and the slow steps.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/motion_spectrum.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/chain_kinematics.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;

/// A bending chain led through targets, z optimised for modes of which most are fast.
struct BoundedScene {
  explicit BoundedScene(double period_frames = 12, double weight = 100) {
    chain = std::make_shared<ChainKinematics>(10, 8, 1.0, 2.0, 3);
    timeline.frame_count = 80;
    for (const auto& constraint : test_constraints(*chain, 6, timeline, 0.5, weight, 5))
      constraints.positions[constraint.id] = constraint;
    material = {test_dynamics(4, period_frames, 0.01), first_coordinates(10, 4)};
    Solver solver(chain, material.dynamics, timeline, {}, material.mixing);
    for (const auto& [id, constraint] : constraints.positions) solver.add(constraint);
    forces_alone = solver.solve();
    motion = solver.motion();
  }

  [[nodiscard]] MaterialSolver solver(const MaterialOptions& options = {}) const {
    return {chain, timeline, constraints, material, motion, options};
  }

  std::shared_ptr<ChainKinematics> chain;
  Timeline timeline;
  ConstraintSet constraints;
  Material material;
  Eigen::MatrixXd motion;
  SolveReport forces_alone;
};

double highest(const Material& material) {
  return frequency_of(material.dynamics.stiffness.maxCoeff());
}

TEST(BoundedMaterial, FrequencyAndStiffnessAreInverse) {
  for (const double frequency : {1e-6, 0.01, 1.0 / 24, 0.125, 0.3, 0.5}) {
    EXPECT_NEAR(frequency_of(stiffness_of(frequency)), frequency, 1e-8 * frequency + 1e-9);
    EXPECT_NEAR(stiffness_of(frequency), 2 - 2 * std::cos(2 * 3.14159265358979 * frequency), 1e-12);
  }
  EXPECT_EQ(frequency_of(17), 0.5);
}

TEST(BoundedMaterial, NoFittedModeIsAboveTheBoundInAnyStep) {
  const BoundedScene scene;
  ASSERT_GT(highest(scene.material), 0.125);
  for (const auto variables : {MaterialVariables::kMotionAndDynamics, MaterialVariables::kAll}) {
    for (const int slow_steps : {0, 10}) {
      MaterialOptions options;
      options.variables = variables;
      options.slow_steps = slow_steps;
      options.slow_frequency = 1.0 / 40;
      MaterialSolver solver = scene.solver(options);
      int steps = 0;
      const MaterialReport report = solver.solve({}, [&](const MaterialReport&) {
        ++steps;
        const double bound = steps <= slow_steps ? 1.0 / 40 : 0.125;
        EXPECT_LE(highest(solver.material()), bound * (1 + 1e-9)) << steps;
        return true;
      });
      EXPECT_LE(highest(solver.material()), 0.125 * (1 + 1e-9));
      EXPECT_TRUE(report.below_start);
      EXPECT_LT(report.total_energy, scene.forces_alone.total_energy);
    }
  }
}

TEST(BoundedMaterial, ASlowStartEndsLowerThanTheBoundAlone) {
  const BoundedScene scene;
  MaterialOptions bound_only;
  bound_only.slow_steps = 0;
  MaterialSolver slow = scene.solver(), other = scene.solver(bound_only);
  EXPECT_LT(slow.solve().total_energy, other.solve().total_energy);
}

/// Targets on the path of a swing of 5 frames: slower modes cost forces that this one does not.
struct FastSwing {
  FastSwing() {
    kinematics =
        std::make_shared<testing::LinearKinematics>(testing::LinearKinematics::translation(1.0));
    timeline = {60, EndCondition::kFree, EndCondition::kFree};
    const double stiffness = stiffness_of(0.2);
    material = {{Eigen::Vector3d::Constant(stiffness), Eigen::Vector3d::Zero()},
                Eigen::Matrix3d::Identity()};
    motion.resize(3, 60);
    for (int i = 0; i < 60; ++i)
      motion.col(i) = std::sin(0.4 * 3.14159265358979 * i) * Eigen::Vector3d(1, 0.5, -0.7);
    for (int i = 0; i < 60; ++i) {
      constraints.positions[static_cast<ConstraintId>(i + 1)] = {
          static_cast<ConstraintId>(i + 1), i, 0, 7, motion.col(i), 100};
    }
  }
  [[nodiscard]] MaterialSolver solver(const MaterialOptions& options) const {
    return {kinematics, timeline, constraints, material, motion, options};
  }
  std::shared_ptr<const reduced::Kinematics> kinematics;
  Timeline timeline;
  ConstraintSet constraints;
  Material material;
  Eigen::MatrixXd motion;
};

TEST(BoundedMaterial, AStartThatNoBoundedMaterialReachesIsKeptAsItWas) {
  FastSwing scene;
  // Not quite an optimum, so that there is an energy to keep.
  scene.motion *= 1.01;
  MaterialOptions options;
  options.variables = MaterialVariables::kMotionAndDynamics;
  MaterialSolver solver = scene.solver(options);
  int above = 0;
  const MaterialReport report = solver.solve({}, [&](const MaterialReport& now) {
    above += !now.below_start;
    return true;
  });
  EXPECT_GT(above, 0);
  EXPECT_FALSE(report.below_start);
  EXPECT_EQ(report.status, SolveStatus::kStalled);
  EXPECT_NE(report.message, "");
  EXPECT_EQ(solver.material().dynamics.stiffness, scene.material.dynamics.stiffness);
  EXPECT_LT((solver.motion() - scene.motion).norm(), 1e-12 * scene.motion.norm());
  // With its own frequency allowed it is found to be as good as it is.
  options.max_frequency = 0.25;
  options.slow_steps = 0;
  MaterialSolver free = scene.solver(options);
  EXPECT_TRUE(free.solve().below_start);
}

TEST(BoundedMaterial, ACancelledFitAboveItsStartIsTheStart) {
  const BoundedScene scene(6);
  MaterialSolver solver = scene.solver();
  JobContext job;
  int steps = 0;
  bool was_above = false;
  const MaterialReport report = solver.solve(job, [&](const MaterialReport& now) {
    if (++steps == 1) {
      was_above = !now.below_start;
      job.cancellation.request();
    }
    return true;
  });
  EXPECT_EQ(report.status, SolveStatus::kCancelled);
  EXPECT_LE(report.total_energy, scene.forces_alone.total_energy * (1 + 1e-12));
  if (was_above) {
    EXPECT_EQ(solver.material().dynamics.stiffness, scene.material.dynamics.stiffness);
  }
}

TEST(BoundedMaterial, AnInterruptedFitContinuesWhereItWas) {
  const BoundedScene scene;
  MaterialSolver whole = scene.solver();
  const MaterialReport expected = whole.solve();
  MaterialSolver first = scene.solver();
  int steps = 0;
  first.solve({}, [&](const MaterialReport&) { return ++steps < 4; });
  MaterialOptions rest;
  rest.slow_steps -= 4;
  rest.max_iterations -= 4;
  MaterialSolver second = scene.solver(rest);
  second.resume(first.material(), first.motion());
  const MaterialReport report = second.solve();
  EXPECT_TRUE(report.below_start);
  // Levenberg's damping begins anew, so the path is not the same to the last digit.
  EXPECT_LT(report.total_energy, 2 * expected.total_energy);
  EXPECT_THROW(second.resume(first.material(), Eigen::MatrixXd::Zero(4, 7)), Error);
}

TEST(BoundedMaterial, TheSlowestNeededIsTheElasticModeOfReference) {
  const auto dynamics = [](std::initializer_list<double> stiffness) {
    const auto count = static_cast<Eigen::Index>(stiffness.size());
    return ModeDynamics{Eigen::Map<const Eigen::VectorXd>(stiffness.begin(), count),
                        Eigen::VectorXd::Zero(count)};
  };
  const double slow = stiffness_of(1.0 / 50);
  EXPECT_NEAR(slow_frequency_of(dynamics({slow, 0.5}), 0), 1.0 / 50, 1e-9);
  EXPECT_NEAR(slow_frequency_of(dynamics({0, 1e-9, slow, 0.5}), 2), 1.0 / 50, 1e-9);
  EXPECT_EQ(slow_frequency_of(dynamics({0.5, 0.7}), 0), 1.0 / 24);
  EXPECT_EQ(slow_frequency_of(dynamics({0, 0}), 2), 1.0 / 24) << "no elastic mode";
  EXPECT_EQ(slow_frequency_of(dynamics({0}), 0), 1.0 / 24) << "only a mechanism";
}

TEST(BoundedMaterial, ExactConstraintsAreApproached) {
  const BoundedScene scene(12, PositionConstraint::kExact);
  MaterialSolver solver = scene.solver();
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(report.below_start);
  EXPECT_LT(report.max_exact_error, 1e-4 * scene.chain->length());
  EXPECT_LE(highest(solver.material()), 0.125 * (1 + 1e-9));
}

}  // namespace
}  // namespace limber::spacetime
