// Space-time optima of linear kinematics, where all of it can be solved densely in long double.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "bench/stability/sweep.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::bench::stability {
namespace {

using spacetime::dense_optimum;
using spacetime::linear_constraints;
using spacetime::ModeDynamics;
using spacetime::PositionConstraint;
using spacetime::SolveReport;
using spacetime::SolveStatus;
using spacetime::test_dynamics;
using spacetime::Timeline;
using testing::LinearKinematics;

constexpr double kAllowedEnergy = 1e-6;
// Limit of motions, in units of the limit of energies: these are flat about an optimum.
constexpr double kAllowedMotion = 1e-5;
constexpr int kFrames = 40;
constexpr double kNoMotion = 1e-12;  // weights that hardly pull may be left to rest

Claim claim_of(const SolveReport& report) {
  return report.status == SolveStatus::kConverged ? Claim::kConverged : Claim::kNotConverged;
}

/// E_f + sum gamma E_c of z = 0, for energies that are rounding compared with it.
double energy_at_rest(const LinearKinematics& kinematics,
                      const std::vector<PositionConstraint>& constraints) {
  double energy = 0;
  for (const PositionConstraint& constraint : constraints)
    if (std::isfinite(constraint.weight))
      energy += 0.5 * constraint.weight * (constraint.target / kinematics.length()).squaredNorm();
  return energy;
}

Finding against_dense(const LinearKinematics& kinematics, const ModeDynamics& dynamics,
                      const Timeline& timeline,
                      const std::vector<PositionConstraint>& constraints) {
  spacetime::Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
  for (const PositionConstraint& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  const spacetime::DenseAnswer dense = dense_optimum(kinematics, dynamics, timeline, constraints);
  Finding finding;
  finding.claim = claim_of(report);
  finding.is_finite = solver.motion().allFinite() && std::isfinite(report.total_energy);
  const double scale = std::max(dense.energy, 1e-8 * energy_at_rest(kinematics, constraints));
  const double energy_error = std::abs(report.total_energy - dense.energy) / scale;
  const double motion_error =
      (solver.motion() - dense.z).norm() / std::max(dense.z.norm(), kNoMotion);
  finding.error = std::max(energy_error, motion_error * kAllowedEnergy / kAllowedMotion);
  // If the rows lose their rank even in long double, there is nothing to compare with: an answer
  // that claims to be one counts as wrong.
  const bool has_reference = dense.z.norm() > 0 && std::isfinite(energy_error);
  if (!has_reference) finding.error = 1;
  finding.allowed = kAllowedEnergy;
  finding.message = fmt::format("{} iterations, energy off by {:.2g}, motion by {:.2g}. {}",
                                report.iterations, energy_error, motion_error, report.message);
  return finding;
}

Finding with_weight(double weight) {
  const LinearKinematics kinematics(3, 2, 1.0, 7);
  return against_dense(kinematics, test_dynamics(3, 20, 0.01), {kFrames},
                       linear_constraints(kinematics, 4, kFrames, weight, 8));
}

/// The stiffest mode over the softest.
Finding with_spread(double ratio, double weight) {
  const LinearKinematics kinematics(4, 2, 1.0, 9);
  ModeDynamics dynamics = test_dynamics(4, 40, 0.01);
  for (int k = 0; k < 4; ++k) {
    dynamics.stiffness[k] = dynamics.stiffness[0] * std::pow(ratio, k / 3.0);
    dynamics.damping[k] = 0.02 * std::sqrt(dynamics.stiffness[k]);
  }
  return against_dense(kinematics, dynamics, {kFrames},
                       linear_constraints(kinematics, 4, kFrames, weight, 10));
}

/// Targets in two successive frames that demand a jump, by slow modes.
Finding neighbouring_frames(double period) {
  const LinearKinematics kinematics(3, 1, 1.0, 11);
  std::vector<PositionConstraint> constraints =
      linear_constraints(kinematics, 2, kFrames, PositionConstraint::kExact, 12);
  constraints[0].frame = 20;
  constraints[1].frame = 21;
  return against_dense(kinematics, test_dynamics(3, period, 0.01), {kFrames}, constraints);
}

Finding of_length(double length) {
  const LinearKinematics kinematics(3, 2, length, 13);
  return against_dense(kinematics, test_dynamics(3, 20, 0.01), {kFrames},
                       linear_constraints(kinematics, 4, kFrames, 100, 14));
}

/// Two exact targets for one site in one frame, so far apart [body lengths]: the middle is held.
Finding contradicted(double apart) {
  const LinearKinematics kinematics(6, 2, 1.0, 15);
  const Timeline timeline{kFrames};
  const ModeDynamics dynamics = test_dynamics(6, 20, 0.01);
  std::vector<PositionConstraint> constraints =
      linear_constraints(kinematics, 3, kFrames, PositionConstraint::kExact, 16);
  std::vector<PositionConstraint> middle = constraints;
  PositionConstraint other = constraints[1];
  other.id = 100;
  const Eigen::Vector3d by = apart * Eigen::Vector3d(2, -1, 2) / 3;
  other.target += by;
  middle[1].target += by / 2;
  constraints.push_back(other);
  spacetime::Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
  for (const PositionConstraint& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  const spacetime::DenseAnswer dense = dense_optimum(kinematics, dynamics, timeline, middle);
  Finding finding;
  finding.claim = claim_of(report);
  finding.is_finite = solver.motion().allFinite();
  // It must say that they contradict each other, and by how much they are missed.
  const double miss = std::abs(report.max_exact_error - apart / 2) / std::max(1e-6, apart);
  const bool says_so = report.rank_deficient && !report.message.empty();
  finding.error = says_so ? std::max(miss, (solver.motion() - dense.z).norm() / dense.z.norm()) : 1;
  finding.allowed = 1e-4;
  finding.message = fmt::format("missed by {:.3g}. {}", report.max_exact_error, report.message);
  return finding;
}

/// Modes that few targets act on.
Finding with_modes(double count) {
  const int modes = static_cast<int>(count);
  const LinearKinematics kinematics(modes, 2, 1.0, 17);
  constexpr int kFew = 12;  // the dense system has modes times frames unknowns
  return against_dense(kinematics, test_dynamics(modes, 10, 0.01), {kFew},
                       linear_constraints(kinematics, 4, kFew, 100, 18));
}

Finding with_frames(double count) {
  const int frames = static_cast<int>(count);
  const LinearKinematics kinematics(2, 2, 1.0, 19);
  // If an end leaves velocities free, motions that would grow more than four times towards it are
  // held at zero there (spacetime/NOTATION.md). That problem differs from the dense one. Short
  // scenes have no room for held velocities, nor for growth.
  const auto end = frames > 30 ? spacetime::EndCondition::kPinnedPositionVelocity
                               : spacetime::EndCondition::kPinnedPosition;
  Timeline timeline{frames, end, end};
  std::vector<PositionConstraint> constraints = linear_constraints(kinematics, 2, 8, 100, 20);
  constraints[0].frame = constraints[1].frame = frames / 2;
  constraints[1].site = 1 - constraints[0].site;
  return against_dense(kinematics, test_dynamics(2, 10, 0.01), timeline, constraints);
}

Sweep motion_sweep(const char* name, const char* parameter, std::vector<double> values,
                   int required, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "spacetime";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "the motion of least energy under four targets, linear kinematics";
  sweep.check = "all unknowns at once, dense, in long double: energy and motion";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps linear_motion_sweeps() {
  std::vector<double> exact_weight = decades(0, 12, 2);
  exact_weight.push_back(PositionConstraint::kExact);
  Sweep conflict = motion_sweep("contradicting exact targets", "distance [body lengths]",
                                decades(-2, 6, 2), 3, contradicted);
  conflict.asked = "exact targets of which two contradict each other";
  conflict.check = "the dense optimum with the middle of both, and the reported miss";
  return {
      motion_sweep("heavy targets", "weight", exact_weight, 8, with_weight),
      motion_sweep("light targets", "weight", decades(0, -30, -5), 7, with_weight),
      motion_sweep("spread of stiffness", "stiffest over softest mode", decades(0, 20, 2), 5,
                   [](double ratio) { return with_spread(ratio, 100); }),
      motion_sweep("spread of stiffness, exact targets", "stiffest over softest mode",
                   decades(0, 20, 2), 5,
                   [](double ratio) { return with_spread(ratio, PositionConstraint::kExact); }),
      motion_sweep("a jump between neighbouring frames", "period [frames]", decades(1, 9), 5,
                   neighbouring_frames),
      motion_sweep("length unit", "body length", {1, 1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9}, 7,
                   of_length),
      conflict,
      motion_sweep("number of modes, linear", "modes", {1, 2, 8, 32, 64}, 5, with_modes),
      motion_sweep("number of frames, linear", "frames", {3, 4, 5, 30, 300}, 5, with_frames),
  };
}

}  // namespace limber::bench::stability
