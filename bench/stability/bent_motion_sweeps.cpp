// Space-time optima of kinematics that bend: many frames, many modes, far targets, full stretch.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "bench/stability/sweep.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/literal_spacetime.h"
#include "tests/support/two_link_arm.h"

namespace limber::bench::stability {
namespace {

using spacetime::ModeDynamics;
using spacetime::PositionConstraint;
using spacetime::SolveReport;
using spacetime::SolveStatus;
using spacetime::test_constraints;
using spacetime::test_dynamics;
using spacetime::Timeline;
using testing::ChainKinematics;
using testing::LiteralSpacetime;
using testing::TwoLinkArm;

constexpr double kAllowedBent = 1e-6;

/// Soft targets: the paper's method, all frames at once, from the answer.
Finding against_literal(const std::shared_ptr<const reduced::Kinematics>& kinematics,
                        const ModeDynamics& dynamics, const Timeline& timeline,
                        const std::vector<PositionConstraint>& constraints) {
  spacetime::Solver solver(kinematics, dynamics, timeline);
  for (const PositionConstraint& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  Finding finding;
  finding.claim =
      report.status == SolveStatus::kConverged ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = solver.motion().allFinite() && std::isfinite(report.total_energy);
  finding.allowed = kAllowedBent;
  finding.message = fmt::format("{} iterations. {}", report.iterations, report.message);
  if (!finding.is_finite) return finding;
  LiteralSpacetime literal(kinematics, dynamics, timeline, constraints);
  const double energy =
      literal.force_energy(solver.motion()) + literal.constraint_energy(solver.motion());
  const double best = literal.solve_from(solver.motion()).total_energy;
  const double rest = literal.constraint_energy(
      Eigen::MatrixXd::Zero(dynamics.stiffness.size(), timeline.frame_count));
  finding.error =
      std::max(std::abs(report.total_energy - energy), energy - best) / std::max(best, 1e-9 * rest);
  return finding;
}

Finding with_frames(double count) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{static_cast<int>(count)};
  return against_literal(kinematics, test_dynamics(6, std::max(5.0, count / 50), 0.01), timeline,
                         test_constraints(*kinematics, count < 20 ? 1 : 8, timeline, 0.3, 10, 51));
}

Finding with_modes(double count) {
  const int modes = static_cast<int>(count);
  const auto kinematics = std::make_shared<ChainKinematics>(modes, 12, 1.0, 2.0, 5);
  const Timeline timeline{40};
  return against_literal(kinematics, test_dynamics(modes, 20, 0.01), timeline,
                         test_constraints(*kinematics, 6, timeline, 0.2, 10, 52));
}

Finding with_far_targets(double lengths) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{60};
  auto constraints = test_constraints(*kinematics, 4, timeline, 0.3, 1.0, 47);
  for (std::size_t i = 0; i < constraints.size(); ++i)
    constraints[i].target = 2 * lengths * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 3));
  return against_literal(kinematics, test_dynamics(6, 40, 0.01), timeline, constraints);
}

/// A chain that a unit of z bends by so much [rad].
Finding with_bend(double bend) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 12, bend, 2.0, 3);
  const Timeline timeline{60};
  return against_literal(kinematics, test_dynamics(6, 40, 0.01), timeline,
                         test_constraints(*kinematics, 4, timeline, 1.0, 100, 53));
}

/// A target at this distance from the pivot of two links of length one.
Finding stretched(double distance, double weight) {
  PositionConstraint far;
  far.id = 1;
  far.frame = 20;
  far.axes = 3;
  far.target = {-1, distance, 0};
  far.weight = weight;
  return against_literal(std::make_shared<TwoLinkArm>(), test_dynamics(2, 30, 0.01), {40}, {far});
}

/// Exact targets in reach: how well they are held, and whether softer ones that approach them
/// agree.
Finding held_exactly(double amplitude) {
  const auto kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, 2.0, 3);
  const ModeDynamics dynamics = test_dynamics(9, 40, 0.01);
  const Timeline timeline{80};
  const auto constraints =
      test_constraints(*kinematics, 6, timeline, amplitude, PositionConstraint::kExact, 41);
  spacetime::Solver solver(kinematics, dynamics, timeline);
  for (const PositionConstraint& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  Finding finding;
  finding.claim =
      report.status == SolveStatus::kConverged ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = solver.motion().allFinite();
  finding.message = fmt::format("{} iterations, missed by {:.2g}. {}", report.iterations,
                                report.max_exact_error, report.message);
  finding.allowed = 1e-3;
  if (!finding.is_finite) return finding;
  // At a minimum that holds exact targets, heavy soft ones take off miss^2 weight and no more.
  auto heavy = constraints;
  for (PositionConstraint& constraint : heavy) constraint.weight = 1e7;
  LiteralSpacetime literal(kinematics, dynamics, timeline, heavy);
  const double energy = literal.force_energy(solver.motion());
  const double missed = std::sqrt(2 * literal.constraint_energy(solver.motion()) / 1e7);
  const double best = literal.solve_from(solver.motion()).total_energy;
  finding.error = std::max(
      {std::abs(energy - report.total_energy) / energy, (energy - best) / energy, 1e4 * missed});
  return finding;
}

Sweep bent_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                 std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "spacetime";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "the motion of least energy under soft targets, a chain of links";
  sweep.check = "the paper's method on all frames: energy of the motion, and what it still gains";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps bent_motion_sweeps() {
  const std::vector<double> reach = {0.5,      0.9,    0.99, 0.9999, 1 - 1e-8, 1,
                                     1 + 1e-8, 1.0001, 1.01, 2,      10,       1e3};
  Sweep exact = bent_sweep("exact targets", "amplitude of the pose that they come from",
                           {0.01, 0.1, 0.3, 1, 3, 10}, 3, held_exactly);
  exact.check = "the paper's method with weights of 1e7 on all frames; misses times 1e4";
  return {
      bent_sweep("number of frames", "frames", {5, 10, 100, 1e3, 1e4, 1e5}, 6, with_frames),
      bent_sweep("number of modes", "modes", {1, 3, 10, 30, 100}, 5, with_modes),
      bent_sweep("far targets", "distance [body lengths]", decades(0, 6), 2, with_far_targets),
      bent_sweep("large bends", "bend of a unit of z [rad]", {0.1, 1, 3, 6.2, 6.3, 12, 30, 100}, 4,
                 with_bend),
      bent_sweep("full stretch", "distance of the target over the reach", reach, 4,
                 [](double distance) { return stretched(distance, 100); }),
      bent_sweep("full stretch, heavy", "distance of the target over the reach", reach, 0,
                 [](double distance) { return stretched(distance, 1e8); }),
      exact,
  };
}

}  // namespace limber::bench::stability
