#include "engine/spacetime/material_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "engine/spacetime/material_step.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/chain_kinematics.h"
#include "tests/support/dense.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;

constexpr int kChainCoordinates = 10, kChainModes = 4;

Material first_modes(int coordinates, int modes) {
  return {test_dynamics(modes, 40, 0.01), first_coordinates(coordinates, modes)};
}

struct MaterialScene {
  std::shared_ptr<const reduced::Kinematics> kinematics;
  Timeline timeline;
  std::vector<PositionConstraint> constraints;
  Material material;
  Eigen::MatrixXd motion;  // of z alone
  SolveReport z_only;
};

/// A bending chain led through targets, z optimised.
MaterialScene chain_scene(int frames = 60, int constraints = 6, int modes = kChainModes,
                          int coordinates = kChainCoordinates) {
  MaterialScene scene;
  const auto chain = std::make_shared<ChainKinematics>(coordinates, 8, 1.0, 2.0, 3);
  scene.kinematics = chain;
  scene.timeline.frame_count = frames;
  scene.constraints = test_constraints(*chain, constraints, scene.timeline, 0.5, 100, 5);
  scene.material = first_modes(coordinates, modes);
  Solver solver(scene.kinematics, scene.material.dynamics, scene.timeline, {},
                scene.material.mixing);
  for (const auto& constraint : scene.constraints) solver.add(constraint);
  scene.z_only = solver.solve();
  scene.motion = solver.motion();
  return scene;
}

ConstraintSet set_of(const MaterialScene& scene) {
  ConstraintSet set;
  for (const auto& constraint : scene.constraints) set.positions[constraint.id] = constraint;
  return set;
}

MaterialSolver solver_of(const MaterialScene& scene, const MaterialOptions& options = {}) {
  return {scene.kinematics, scene.timeline, set_of(scene), scene.material, scene.motion, options};
}

/// Of eqs. 17a, 17b and 20, straight from the motion and the material.
double energy_of(const MaterialScene& scene, const Material& material,
                 const Eigen::MatrixXd& motion, double column_weight) {
  double energy = column_weight * column_energy(material.mixing);
  for (Eigen::Index k = 0; k < motion.rows(); ++k) {
    for (Eigen::Index i = 1; i + 1 < motion.cols(); ++i) {
      const double velocity = motion(k, i + 1) - motion(k, i);
      const double acceleration = velocity - motion(k, i) + motion(k, i - 1);
      const double force = acceleration + material.dynamics.damping[k] * velocity +
                           material.dynamics.stiffness[k] * motion(k, i);
      energy += 0.5 * force * force;
    }
  }
  for (const auto& constraint : scene.constraints) {
    Eigen::Matrix3Xd u;
    const int frames[] = {constraint.frame};
    const reduced::SiteQuery queries[] = {{constraint.site, 0}};
    scene.kinematics->evaluate(frames, material.mixing * motion.col(constraint.frame), queries, u,
                               nullptr);
    for (int axis = 0; axis < 3; ++axis) {
      if ((constraint.axes >> axis & 1U) == 0) continue;
      const double miss = (constraint.target[axis] - u(axis, 0)) / scene.kinematics->length();
      energy += 0.5 * constraint.weight * miss * miss;
    }
  }
  return energy;
}

bool finite(const MaterialSolver& solver) {
  return solver.motion().allFinite() && solver.material().mixing.allFinite() &&
         solver.material().dynamics.stiffness.allFinite() &&
         solver.material().dynamics.damping.allFinite();
}

void expect_no_worse(const MaterialScene& scene, const MaterialReport& report) {
  EXPECT_TRUE(std::isfinite(report.total_energy));
  EXPECT_LE(report.total_energy, scene.z_only.total_energy * (1 + 1e-9));
}

/// The step is that of the assembled Gauss-Newton matrix over every z and every entry of S.
void expect_step_of_the_assembled_system(const MaterialScene& scene) {
  ConstraintRows rows(scene.kinematics, {}, kChainCoordinates);
  ModeSystems systems(scene.material.dynamics, scene.timeline);
  rows.rebuild(set_of(scene), systems.frames());
  systems.set_knots(rows.knots());
  MaterialPoint point;
  point.mixing = scene.material.mixing;
  point.mixing(kChainCoordinates - 1, 1) = 0.3;
  point.mixing(2, 0) = -0.2;
  systems.gather(scene.motion, point.z);
  const auto knots = static_cast<Eigen::Index>(rows.knots().size());
  Lanes hat = Lanes::Zero(padded_lanes(kChainCoordinates), knots);
  for (int knot = 0; knot < knots; ++knot)
    hat.col(knot).head(kChainCoordinates) =
        point.mixing * point.z.col(systems.kept_of_knot(knot)).head(kChainModes);
  rows.evaluate(hat, ConstraintRows::Jacobian::kYes, point.rows);

  for (const int held : {0, 1}) {
    const double nu = 0.7, mu = 2;
    MaterialSpace space;
    MaterialStep step;
    space.step(systems, rows, point, {nu, mu, held}, step);

    const int kept = systems.kept_count();
    const int z_size = kept * kChainModes, s_size = kChainCoordinates * kChainModes;
    const auto z_at = [&](int frame, int mode) { return frame * kChainModes + mode; };
    const auto s_at = [&](Eigen::Index row, Eigen::Index mode) {
      return z_size + static_cast<int>(mode * kChainCoordinates + row);
    };
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(z_size + s_size, z_size + s_size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(z_size + s_size);
    for (int frame = 0; frame < kept; ++frame) {
      for (int mode = 0; mode < kChainModes; ++mode) {
        Lanes unit = Lanes::Zero(systems.lanes(), kept), product;
        unit(mode, frame) = 1;
        systems.apply(unit, product);
        for (int other = 0; other < kept; ++other)
          hessian(z_at(other, mode), z_at(frame, mode)) = product(mode, other);
        hessian(z_at(frame, mode), z_at(frame, mode)) += ModeSystems::kProximal;
        gradient[z_at(frame, mode)] = product.cwiseProduct(point.z).sum();
      }
    }
    for (int row = 0; row < rows.count(); ++row) {
      Eigen::VectorXd along = Eigen::VectorXd::Zero(z_size + s_size);
      for (int term = 0; term < rows.term_count(); ++term) {
        if (rows.row_of(term) != row) continue;
        const int frame = systems.kept_of_knot(rows.knot_of(term));
        const Eigen::VectorXd j = point.rows.jacobian.col(term).head(kChainCoordinates);
        for (int mode = 0; mode < kChainModes; ++mode) {
          along[z_at(frame, mode)] += j.dot(point.mixing.col(mode));
          for (int c = 0; c < kChainCoordinates; ++c)
            along[s_at(c, mode)] += point.z(mode, frame) * j[c];
        }
      }
      hessian += rows.weight()[row] * along * along.transpose();
      gradient -= rows.weight()[row] * point.rows.residual[row] * along;
    }
    for (int mode = 0; mode < kChainModes; ++mode) {
      const Eigen::VectorXd s = point.mixing.col(mode);
      hessian.block(s_at(0, mode), s_at(0, mode), kChainCoordinates, kChainCoordinates) +=
          8 * mu * s * s.transpose() +
          nu * Eigen::MatrixXd::Identity(kChainCoordinates, kChainCoordinates);
      gradient.segment(s_at(0, mode), kChainCoordinates) += 4 * mu * (s.squaredNorm() - 1) * s;
    }
    for (int mode = 0; mode < kChainModes; ++mode) {
      for (int c = 0; c < kChainCoordinates; ++c) {
        if (mode >= held && c >= held) continue;  // these entries of S stay
        hessian.row(s_at(c, mode)).setZero();
        hessian.col(s_at(c, mode)).setZero();
        hessian(s_at(c, mode), s_at(c, mode)) = 1;
        gradient[s_at(c, mode)] = 0;
      }
    }
    const Eigen::VectorXd expected = -reference::solve_symmetric(hessian, gradient);
    Eigen::VectorXd found(z_size + s_size);
    for (int frame = 0; frame < kept; ++frame)
      found.segment(z_at(frame, 0), kChainModes) = step.z.col(frame).head(kChainModes);
    found.tail(s_size) = step.mixing.reshaped();
    EXPECT_LT((found - expected).norm(), 1e-8 * expected.norm()) << "held " << held;
    // The promise is the decrease of the model without Levenberg's and the proximal term.
    Eigen::MatrixXd undamped = hessian;
    undamped.diagonal().head(z_size).array() -= ModeSystems::kProximal;
    for (int mode = held; mode < kChainModes; ++mode) {
      for (int c = held; c < kChainCoordinates; ++c) undamped(s_at(c, mode), s_at(c, mode)) -= nu;
    }
    EXPECT_NEAR(step.promise, -gradient.dot(found) - 0.5 * found.dot(undamped * found),
                1e-8 * step.promise);
  }
}

TEST(MaterialStep, IsThatOfTheAssembledSystem) {
  expect_step_of_the_assembled_system(chain_scene());
}

TEST(MaterialStep, IsThatOfTheAssembledSystemWithVelocities) {
  MaterialScene scene = chain_scene();
  for (std::size_t i = 0; i < scene.constraints.size(); i += 2) {
    scene.constraints[i].since = scene.constraints[i].frame - 2;
    scene.constraints[i].weight *= 100;
  }
  expect_step_of_the_assembled_system(scene);
}

TEST(MaterialSolver, LowersTheEnergyOfEachSetOfVariablesBelowTheOneBefore) {
  const MaterialScene scene = chain_scene();
  double before = scene.z_only.total_energy;
  for (const auto variables : {MaterialVariables::kMotionAndDynamics, MaterialVariables::kAll}) {
    MaterialOptions options;
    options.variables = variables;
    MaterialSolver solver = solver_of(scene, options);
    double last = std::numeric_limits<double>::infinity();
    int steps = 0;
    const MaterialReport report = solver.solve({}, [&](const MaterialReport& now) {
      EXPECT_LE(now.total_energy, last) << steps;
      EXPECT_EQ(now.below_start, now.total_energy < scene.z_only.total_energy) << steps;
      last = now.total_energy;
      ++steps;
      return true;
    });
    EXPECT_LT(report.total_energy, 0.9 * before);
    before = report.total_energy;
    EXPECT_NEAR(report.total_energy,
                energy_of(scene, solver.material(), solver.motion(), options.column_weight),
                1e-9 * report.total_energy);
    EXPECT_NEAR(report.total_energy,
                report.force_energy + report.constraint_energy + report.column_energy,
                1e-12 * report.total_energy);
    EXPECT_TRUE((solver.material().dynamics.stiffness.array() >= 0).all());
    EXPECT_TRUE((solver.material().dynamics.damping.array() >= 0).all());
    if (variables != MaterialVariables::kAll) {
      EXPECT_EQ(solver.material().mixing, scene.material.mixing);
    }
  }
}

/// Targets on the path of a damped swing: the material that made them needs no force at all.
TEST(MaterialSolver, FindsTheStiffnessAndDampingThatTargetsWereMadeWith) {
  const auto kinematics = std::make_shared<LinearKinematics>(LinearKinematics::translation(1.0));
  const double stiffness[] = {0.02, 0.05, 0.11}, damping[] = {0.01, 0.0, 0.03};
  const int frames = 80;
  Eigen::Matrix3Xd truth(3, frames);
  for (int k = 0; k < 3; ++k) {
    truth(k, 0) = 1;
    truth(k, 1) = 0.9;
    for (int i = 1; i + 1 < frames; ++i) {
      truth(k, i + 1) =
          ((2 + damping[k] - stiffness[k]) * truth(k, i) - truth(k, i - 1)) / (1 + damping[k]);
    }
  }
  MaterialScene scene;
  scene.kinematics = kinematics;
  scene.timeline = {frames, EndCondition::kFree, EndCondition::kFree};
  for (int frame = 0; frame < frames; frame += 3) {
    scene.constraints.push_back(
        {static_cast<ConstraintId>(frame + 1), frame, 0, 7, truth.col(frame), 100});
  }
  scene.material.dynamics = {Eigen::Vector3d::Constant(0.04), Eigen::Vector3d::Zero()};
  scene.material.mixing = Eigen::Matrix3d::Identity();
  Solver z_only(kinematics, scene.material.dynamics, scene.timeline);
  for (const auto& constraint : scene.constraints) z_only.add(constraint);
  const SolveReport first = z_only.solve();
  scene.motion = z_only.motion();
  MaterialOptions options;
  options.variables = MaterialVariables::kMotionAndDynamics;
  options.tolerance = 1e-6;
  options.max_iterations = 2000;
  MaterialSolver solver = solver_of(scene, options);
  const MaterialReport report = solver.solve();
  EXPECT_LT(report.total_energy, 1e-6 * first.total_energy);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(solver.material().dynamics.stiffness[k], stiffness[k], 1e-3 * stiffness[k]);
    EXPECT_NEAR(solver.material().dynamics.damping[k], damping[k], 1e-3 * 0.03);
  }
}

TEST(MaterialSolver, RestartingFromAConvergedResultChangesNothing) {
  MaterialScene scene = chain_scene();
  MaterialOptions options;
  options.max_iterations = 2000;
  MaterialSolver first = solver_of(scene, options);
  ASSERT_EQ(first.solve().status, SolveStatus::kConverged);
  scene.material = first.material();
  scene.motion = first.motion();
  options.slow_steps = 0;  // on from what is fitted
  MaterialSolver again = solver_of(scene, options);
  EXPECT_EQ(again.solve().status, SolveStatus::kConverged);
  EXPECT_EQ(again.material().mixing, first.material().mixing);
  EXPECT_EQ(again.material().dynamics.stiffness, first.material().dynamics.stiffness);
  EXPECT_EQ(again.material().dynamics.damping, first.material().dynamics.damping);
  EXPECT_LT((again.motion() - first.motion()).norm(), 1e-12 * first.motion().norm());
}

TEST(MaterialSolver, DoesNotDependOnTheScaleOfColumns) {
  const MaterialScene scene = chain_scene();
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  Material scaled = solver.material();
  scaled.mixing *= 2;
  EXPECT_NEAR(unit_force_energy(scaled, solver.motion() / 2), report.unit_force_energy,
              1e-12 * report.unit_force_energy);
  EXPECT_NEAR(report.unit_force_energy, report.force_energy, 0.05 * report.force_energy);
}

TEST(MaterialSolver, RigidUnknownsKeepTheirModesAndHaveNoDynamics) {
  MaterialScene scene = chain_scene();
  scene.material.dynamics.stiffness.head(2).setZero();
  scene.material.dynamics.damping.head(2).setZero();
  MaterialOptions options;
  options.held = 2;
  MaterialSolver solver = solver_of(scene, options);
  solver.solve();
  EXPECT_EQ(solver.material().dynamics.stiffness.head(2), Eigen::Vector2d::Zero());
  EXPECT_EQ(solver.material().dynamics.damping.head(2), Eigen::Vector2d::Zero());
  EXPECT_EQ(solver.material().mixing.leftCols(2), scene.material.mixing.leftCols(2));
  EXPECT_TRUE(solver.material().mixing.topRows(2).rightCols(kChainModes - 2).isZero(0));
  EXPECT_FALSE(solver.material().mixing.rightCols(kChainModes - 2) ==
               scene.material.mixing.rightCols(kChainModes - 2));
}

TEST(MaterialSolver, StopsOnRequestAndKeepsWhatItHas) {
  const MaterialScene scene = chain_scene();
  MaterialSolver solver = solver_of(scene);
  int steps = 0;
  MaterialReport report = solver.solve({}, [&](const MaterialReport&) { return ++steps < 3; });
  EXPECT_EQ(report.status, SolveStatus::kImproved);
  EXPECT_EQ(report.iterations, 3);
  EXPECT_LT(report.total_energy, scene.z_only.total_energy);
  JobContext job;
  job.cancellation.request();
  const Eigen::MatrixXd motion = solver.motion();
  report = solver.solve(job);
  EXPECT_EQ(report.status, SolveStatus::kCancelled);
  EXPECT_EQ(solver.motion(), motion);
}

TEST(MaterialSolver, ExactConstraintsAreApproached) {
  MaterialScene scene = chain_scene();
  for (auto& constraint : scene.constraints) constraint.weight = PositionConstraint::kExact;
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LT(report.max_constraint_error, 1e-4 * scene.kinematics->length());
  EXPECT_LT(report.force_energy, scene.z_only.force_energy);
}

// Hard cases of material optimisation.

TEST(MaterialHardCases, AConstraintFarOutsideWhatTheModesCanReach) {
  MaterialScene scene = chain_scene();
  scene.constraints[0].target = Eigen::Vector3d(30, -20, 40);
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LE(report.total_energy, energy_of(scene, scene.material, scene.motion, 1));
  // Never reached. Without the bound of frequencies and the slow steps the fit ends in a local
  // minimum 10.5 m from the target at a total energy of 3440; with them, by the last digits, at
  // 730 or 1054 and 1.1 or 2.8 m, of a chain 2 m long.
  EXPECT_LT(report.total_energy, 1720);
  EXPECT_LT(report.max_constraint_error, 4);
}

TEST(MaterialHardCases, TwoContradictoryConstraintsAtOneNodeAndFrame) {
  MaterialScene scene = chain_scene();
  scene.constraints[1] = scene.constraints[0];
  scene.constraints[1].id = 77;
  scene.constraints[1].target += Eigen::Vector3d(0.4, 0, 0);
  const double start = energy_of(scene, scene.material, scene.motion, 1);
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LE(report.total_energy, start);
  // Neither is met: they share the gap of 0.4.
  EXPECT_NEAR(report.max_constraint_error, 0.2, 0.05);
}

TEST(MaterialHardCases, ConstraintsAtAdjacentFramesWithLargeJumps) {
  MaterialScene scene = chain_scene();
  scene.constraints.resize(4);
  for (int i = 0; i < 4; ++i) {
    auto& constraint = scene.constraints[static_cast<std::size_t>(i)];
    constraint.frame = 30 + i;
    constraint.site = scene.constraints[0].site;
    constraint.target = Eigen::Vector3d(0, i % 2 == 0 ? 1.0 : -1.0, 0.2);
  }
  const double start = energy_of(scene, scene.material, scene.motion, 1);
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LT(report.total_energy, start);
}

TEST(MaterialHardCases, FourFrames) {
  MaterialScene scene = chain_scene();
  scene.timeline = {4, EndCondition::kPinnedPosition, EndCondition::kFree};
  scene.constraints.resize(2);
  scene.constraints[0].frame = 1;
  scene.constraints[1].frame = 3;
  scene.motion.setZero(kChainModes, 4);
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LE(report.total_energy, energy_of(scene, scene.material, scene.motion, 1));
}

TEST(MaterialHardCases, TwentyThousandFrames) {
  const MaterialScene scene = chain_scene(20000, 8);
  MaterialOptions options;
  options.max_iterations = 20;
  MaterialSolver solver = solver_of(scene, options);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  expect_no_worse(scene, report);
}

TEST(MaterialHardCases, OneMode) {
  const MaterialScene scene = chain_scene(60, 6, 1);
  MaterialSolver solver = solver_of(scene);
  expect_no_worse(scene, solver.solve());
  EXPECT_TRUE(finite(solver));
}

TEST(MaterialHardCases, AsManyModesAsCoordinates) {
  const MaterialScene scene = chain_scene(60, 6, kChainCoordinates);
  MaterialSolver solver = solver_of(scene);
  expect_no_worse(scene, solver.solve());
  EXPECT_TRUE(finite(solver));
}

TEST(MaterialHardCases, ATargetThatJumpsFarAfterTheFit) {
  for (const double jump : {0.3, 1.0, 3.0}) {
    MaterialScene scene = chain_scene();
    MaterialSolver first = solver_of(scene);
    first.solve();
    scene.material = first.material();
    scene.constraints[2].target += Eigen::Vector3d(0, jump, -jump);
    Solver solver(scene.kinematics, scene.material.dynamics, scene.timeline, {},
                  scene.material.mixing);
    for (const auto& constraint : scene.constraints) solver.add(constraint);
    solver.warm_start(first.motion(), Known::kGuess);
    scene.z_only = solver.solve();
    scene.motion = solver.motion();
    MaterialSolver again = solver_of(scene);
    const MaterialReport report = again.solve();
    EXPECT_NE(report.status, SolveStatus::kStalled) << jump;
    EXPECT_LT(report.total_energy, 0.7 * scene.z_only.total_energy) << jump;
    EXPECT_TRUE(finite(again));
  }
}

TEST(MaterialHardCases, AMotionThatIsZero) {
  MaterialScene scene = chain_scene();
  for (auto& constraint : scene.constraints) constraint.target.setZero();
  scene.motion.setZero();
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged);
  EXPECT_EQ(report.total_energy, 0);
  EXPECT_TRUE(solver.motion().isZero(0));
  // What does not move tells nothing of its dynamics.
  EXPECT_EQ(solver.material().dynamics.stiffness, scene.material.dynamics.stiffness);
}

TEST(MaterialHardCases, OneConstraintThatAFreeSwingMeetsIsConverged) {
  MaterialScene scene = chain_scene();
  scene.timeline = {60, EndCondition::kFree, EndCondition::kFree};
  scene.constraints.resize(1);
  Solver solver(scene.kinematics, scene.material.dynamics, scene.timeline, {},
                scene.material.mixing);
  solver.add(scene.constraints[0]);
  solver.solve();
  scene.motion = solver.motion();
  MaterialSolver material = solver_of(scene);
  const MaterialReport report = material.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.total_energy;
}

TEST(MaterialHardCases, ALambdaDrivenToItsBound) {
  // A target that is reached by moving evenly: any stiffness hinders it.
  MaterialScene scene;
  scene.kinematics = std::make_shared<LinearKinematics>(LinearKinematics::translation(1.0));
  scene.timeline = {40, EndCondition::kFree, EndCondition::kFree};
  for (int i = 0; i < 5; ++i) {
    const int frame = 2 + 8 * i;
    scene.constraints.push_back(
        {static_cast<ConstraintId>(i + 1), frame, 0, 7, Eigen::Vector3d(1, 2, 3) * frame, 100});
  }
  scene.material.dynamics = {Eigen::Vector3d::Constant(0.05), Eigen::Vector3d::Constant(0.02)};
  scene.material.mixing = Eigen::Matrix3d::Identity();
  Solver z_only(scene.kinematics, scene.material.dynamics, scene.timeline);
  for (const auto& constraint : scene.constraints) z_only.add(constraint);
  z_only.solve();
  scene.motion = z_only.motion();
  MaterialOptions options;
  options.variables = MaterialVariables::kMotionAndDynamics;
  MaterialSolver solver = solver_of(scene, options);
  const double start = energy_of(scene, scene.material, scene.motion, 0);
  const MaterialReport report = solver.solve();
  EXPECT_LT(report.total_energy, 1e-3 * start);
  EXPECT_TRUE((solver.material().dynamics.stiffness.array() >= 0).all());
  EXPECT_LT(solver.material().dynamics.stiffness.maxCoeff(), 1e-3);
}

TEST(MaterialHardCases, SWithAColumnGoingToZero) {
  MaterialScene scene = chain_scene();
  scene.material.mixing.col(2) *= 1e-9;
  scene.motion.row(2).setZero();
  const double start = energy_of(scene, scene.material, scene.motion, 1);
  MaterialSolver solver = solver_of(scene);
  const MaterialReport report = solver.solve();
  EXPECT_TRUE(finite(solver));
  EXPECT_LT(report.total_energy, start);
  // Exactly zero is where E_s has no slope: it stays finite all the same.
  scene.material.mixing.col(2).setZero();
  MaterialSolver at_zero = solver_of(scene);
  at_zero.solve();
  EXPECT_TRUE(finite(at_zero));
}

TEST(MaterialBadInput, NamesTheMember) {
  const MaterialScene scene = chain_scene();
  const auto field_of = [&](const auto& change) {
    MaterialScene bad = scene;
    MaterialOptions options;
    change(bad, options);
    try {
      solver_of(bad, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.field();
    }
    return std::string("nothing");
  };
  EXPECT_EQ(field_of([](MaterialScene& s, auto&) {
              s.material.mixing.conservativeResize(9, kChainModes);
            }),
            "material.mixing");
  EXPECT_EQ(field_of([](MaterialScene& s, auto&) {
              s.material = first_modes(kChainCoordinates, kChainCoordinates + 1);
              s.motion.setZero(kChainCoordinates + 1, 60);
            }),
            "material.mixing");
  EXPECT_EQ(field_of([](MaterialScene& s, auto&) { s.material.dynamics.damping[0] = -1; }),
            "material.dynamics");
  EXPECT_EQ(field_of([](MaterialScene& s, auto&) { s.motion(0, 0) = std::nan(""); }), "motion");
  EXPECT_EQ(field_of([](MaterialScene&, MaterialOptions& o) { o.tolerance = 0; }),
            "options.tolerance");
  for (const double bad : {0.0, -0.1, 0.51, std::nan("")}) {
    EXPECT_EQ(field_of([&](MaterialScene&, MaterialOptions& o) { o.max_frequency = bad; }),
              "options.max_frequency");
    EXPECT_EQ(field_of([&](MaterialScene&, MaterialOptions& o) { o.slow_frequency = bad; }),
              "options.slow_frequency");
  }
  EXPECT_EQ(field_of([](MaterialScene&, MaterialOptions& o) { o.slow_steps = -1; }),
            "options.slow_steps");
  EXPECT_EQ(field_of([](MaterialScene&, MaterialOptions& o) { o.column_weight = -1; }),
            "options.column_weight");
  EXPECT_EQ(field_of([](MaterialScene&, MaterialOptions& o) { o.held = kChainModes + 1; }),
            "options.held");
}

TEST(ModeResponse, OfAModeThatWasMadeFromItsRates) {
  // x = exp(s / fps) of a swing of 2 Hz whose amplitude falls by 3 a second, at 50 frames a second.
  const double fps = 50, decay = 3, omega = 2 * std::numbers::pi * 2;
  const double rho = std::exp(-decay / fps), phi = omega / fps;
  const double damping = 1 / (rho * rho) - 1;
  const double stiffness = 2 + damping - 2 * (1 + damping) * rho * std::cos(phi);
  const ModeResponse swing = mode_response(stiffness, damping, fps);
  EXPECT_NEAR(swing.decay_per_s, decay, 1e-9);
  EXPECT_NEAR(swing.frequency_hz, std::hypot(decay, omega) / (2 * std::numbers::pi), 1e-9);
  EXPECT_NEAR(swing.damping_ratio, decay / std::hypot(decay, omega), 1e-9);
  // Two real rates, 4 and 10 a second.
  const double fast = std::exp(-10 / fps), slow = std::exp(-4 / fps);
  const double d = 1 / (fast * slow) - 1;
  const ModeResponse creep = mode_response(2 + d - (1 + d) * (fast + slow), d, fps);
  EXPECT_NEAR(creep.decay_per_s, 4, 1e-8);
  EXPECT_NEAR(creep.frequency_hz, std::sqrt(40.0) / (2 * std::numbers::pi), 1e-8);
  EXPECT_NEAR(creep.damping_ratio, 14 / (2 * std::sqrt(40.0)), 1e-8);
  EXPECT_EQ(mode_response(0, 0, fps).frequency_hz, 0);
  EXPECT_EQ(mode_response(4, 0, fps).frequency_hz, fps / 2);
}

}  // namespace
}  // namespace limber::spacetime
