// Opening angles at their ends, folded edges.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/stability/linkage_checks.h"
#include "bench/stability/sweep.h"
#include "engine/rods/equilibrium/deployment.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::bench::stability {
namespace {

using namespace rods;
using testing::curved_model;
using testing::grid_model;

constexpr double kAllowedAngle = 1e-9;    // rad
constexpr double kAllowedNothing = 1e-8;  // of energies that are zero [N mm]

/// Four bars with one angle so far from pi.
Finding widened(double missing) {
  const LinkageModel model = grid_model(2, 2, 1.0);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.angles = {{0, std::numbers::pi - missing}};
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  Finding finding = finding_of(report, model, state);
  finding.error = std::max(
      std::abs(state.joints()[0].opening_angle - conditions.angles[0].angle) / kAllowedAngle,
      report.energies.total() / kAllowedNothing);
  finding.allowed = 1;
  return finding;
}

/// Equal cells turn for nothing, at any mean angle.
Finding closed(double angle) {
  const LinkageModel model = grid_model(4, 4, 0.6);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = angle;
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  Finding finding = finding_of(report, model, state);
  finding.error = std::max(std::abs(state.mean_opening_angle() - angle) / kAllowedAngle,
                           report.energies.total() / kAllowedNothing);
  finding.allowed = 1;
  return finding;
}

/// Led from shape to shape; where it says that it got there, that must be an equilibrium.
Finding led(double angle) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.pins = {{5}};
  (void)equilibrium.solve(state, conditions);
  conditions.mean_opening_angle = angle;
  const DeploymentReport report = deploy(equilibrium, state, conditions);
  const EquilibriumReport& reached = report.reached;
  Finding finding = finding_of(reached, model, state);
  finding.allowed = 1e-3;
  finding.message = fmt::format("{} branchings, {} limit points, {} jumps. {}", report.branchings,
                                report.limit_points, report.jumps, report.message);
  if (report.status != DeploymentStatus::kReached) {
    finding.claim = Claim::kNotConverged;
    return finding;
  }
  finding.error = std::max(std::abs(state.mean_opening_angle() - angle),
                           minimum_error(model, state, conditions, reached.mean_angle_moment,
                                         std::max(reached.energies.total(), 1e-6)));
  return finding;
}

/// An edge turned back over the one before but for an angle.
Finding unfolded(double missing) {
  const LinkageModel model = grid_model(3, 3, 1.0);
  const LinkageState drawn(model);
  const Eigen::Vector3d along = drawn.vertex(model, 0, 3) - drawn.vertex(model, 0, 2);
  Eigen::VectorXd increment = Eigen::VectorXd::Zero(model.variables().size());
  increment.segment<3>(model.variables().position(0, 3)) =
      -along - std::cos(missing) * along +
      std::sin(missing) * along.norm() * Eigen::Vector3d::UnitZ();
  LinkageState state = drawn.moved(model, increment);
  LinkageEquilibrium equilibrium(model);
  const EquilibriumReport report = equilibrium.solve(state, {});
  Finding finding = finding_of(report, model, state);
  // Infinite where the edge is folded back entirely, which is then said.
  finding.error = report.converged() ? report.energies.total() : 0;
  finding.allowed = kAllowedNothing;
  return finding;
}

Sweep angle_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                  std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "linkages";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps linkage_angle_sweeps() {
  Sweep wide = angle_sweep("an angle near half a turn", "pi - angle [rad]", decades(-1, -12, -1), 9,
                           widened);
  wide.asked = "four bars with one opening angle set";
  wide.check = "the angle (1e-9 rad), and the energy, which is zero (1e-8 N mm)";
  Sweep close = angle_sweep("closed", "mean angle [rad]",
                            {0.3, 0.1, 1e-2, 1e-3, 1e-6, 1e-9, 0, -0.1, -0.3}, 7, closed);
  close.asked = "a flat grid of equal cells, closed";
  close.check = wide.check;
  Sweep lead =
      angle_sweep("led to a mean angle", "mean angle [rad]",
                  {0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.0, 3.1, 3.14, 0.3, 0.1, 0, -0.3, -1}, 3, led);
  lead.asked = "a curved grid, opened and closed step by step";
  lead.check = "differences of the potential: what a step of Newton's method still gains, inertia";
  Sweep fold = angle_sweep("an edge folded back", "angle that is missing [rad]",
                           {1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0}, 4, unfolded);
  fold.asked = "a flat grid with one edge folded back unfolds";
  fold.check = "its energy, which is zero";
  return {wide, close, lead, fold};
}

}  // namespace limber::bench::stability
