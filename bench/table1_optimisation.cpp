#include "bench/table1_optimisation.h"

#include <chrono>
#include <cmath>

#include "bench/literal_material.h"
#include "engine/reduced/modal_projection.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/recovery.h"
#include "engine/spacetime/solver.h"

namespace limber::bench {
namespace {

using reduced::ReducedKinematics;
using spacetime::Material;
using spacetime::MaterialReport;
using spacetime::MaterialSolver;
using spacetime::PositionConstraint;

constexpr double kNoTarget = -1;        // no energy is below it
constexpr double kRepeatedSeconds = 5;  // longer runs are measured once

struct Placed {
  std::shared_ptr<ReducedKinematics> kinematics;
  std::vector<PositionConstraint> constraints;
};

Placed place(const SpacetimeProblem& problem) {
  Placed placed{std::make_shared<ReducedKinematics>(problem.model), {}};
  placed.constraints = place_constraints(problem, *placed.kinematics);
  return placed;
}

/// @param target  energy whose time `reached` gets [s]; it stays below 0 where it is not reached
/// @returns seconds of all
double run(const SpacetimeProblem& problem, const Material& start, double target, Optimised& result,
           double& reached) {
  const auto begin = std::chrono::steady_clock::now();
  const auto since = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const Placed placed = place(problem);
  spacetime::Solver solver(placed.kinematics, start.dynamics, problem.timeline, {}, start.mixing);
  for (const PositionConstraint& constraint : placed.constraints) solver.add(constraint);
  const spacetime::SolveReport z_only = solver.solve();
  result.z_only_seconds = since();
  result.z_only_force_energy = z_only.force_energy;
  if (z_only.total_energy <= target) reached = since();
  MaterialSolver joint(placed.kinematics, problem.timeline, solver.constraint_set(), start,
                       solver.motion());
  const MaterialReport report = joint.solve({}, [&](const MaterialReport& now) {
    if (reached < 0 && now.total_energy <= target) reached = since();
    return true;
  });
  static_cast<void>(joint.motion());
  result.seconds = since();
  result.outer_iterations = report.iterations;
  result.inner_iterations = z_only.iterations + report.evaluations;
  result.converged = report.status == spacetime::SolveStatus::kConverged;
  result.energy = report.total_energy;
  result.force_energy = report.unit_force_energy;
  result.constraint_error = report.max_constraint_error / problem.model->length;
  return result.seconds;
}

}  // namespace

Optimised optimise_positions(const SpacetimeProblem& problem, Baseline baseline, int repeats) {
  const Material start{problem.dynamics, spacetime::first_coordinates(
                                             problem.model->coordinate_count(),
                                             static_cast<int>(problem.dynamics.stiffness.size()))};
  Optimised result;
  double target = kNoTarget;
  if (baseline == Baseline::kLiteral) {
    const Placed placed = place(problem);
    const LiteralMaterialResult literal =
        literal_material(placed.kinematics, problem.timeline, placed.constraints, start, {});
    result.literal_seconds = 1e-3 * literal.milliseconds.back();
    result.literal_energy = target = literal.total_energy;
  }
  std::vector<double> times, z_times, to_literal;
  for (int i = 0; i < repeats; ++i) {
    double reached = -1;
    times.push_back(run(problem, start, target, result, reached));
    z_times.push_back(result.z_only_seconds);
    to_literal.push_back(reached);
  }
  result.seconds = median(times);
  result.z_only_seconds = median(z_times);
  if (baseline == Baseline::kLiteral) result.seconds_to_literal = median(to_literal);
  return result;
}

Optimised optimise_recovery(const RecoveryScene& scene, const reduced::ReducedModel& model,
                            int modes, int repeats) {
  const reduced::ModalProjector projector(scene.generic, model);
  const Eigen::MatrixXd target = projector.motion(scene.displacements).z;
  spacetime::RecoveryOptions options;
  options.modes = modes;
  options.driven_frames = scene.driven_frames;
  spacetime::Recovery recovery;
  std::vector<double> times;
  for (int i = 0; i < repeats && (i == 0 || times.front() < kRepeatedSeconds); ++i) {
    times.push_back(1e-3 * milliseconds([&] {
                      recovery = spacetime::recover(target, model.eigenvalues, options);
                    }));
  }
  Optimised result;
  result.seconds = median(times);
  result.outer_iterations = result.inner_iterations = recovery.report.steps;
  result.converged = recovery.report.status == spacetime::RecoveryStatus::kConverged;
  result.energy = recovery.report.energies.total;
  result.force_energy = recovery.report.energies.force;
  result.constraint_error =
      std::sqrt(2 * recovery.report.energies.constraint / target.squaredNorm());
  return result;
}

}  // namespace limber::bench
