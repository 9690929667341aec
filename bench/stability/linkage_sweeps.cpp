// Equilibria of linkages: units, stiffness, slenderness, short segments, loads and conflicts.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "bench/stability/linkage_checks.h"
#include "bench/stability/sweep.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/edge_counts.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::bench::stability {
namespace {

using namespace rods;
using testing::curved_model;
using testing::gapped_model;
using testing::grid_model;
using testing::joint_distance;
using testing::kStrip;

constexpr double kAllowedShape = 1e-6;  // of the extent
constexpr double kAllowedGain = 1e-3;   // square root of energies
constexpr double kExtent = 200;         // of curved_model() [mm]

struct Shaped {
  LinkageState state;
  EquilibriumReport report;
};

Shaped equilibrium_of(const LinkageModel& model, const Conditions& conditions) {
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  return {state, report};
}

Conditions opened(double scale) {
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.mean_opening_angle = 1.0;
  conditions.loads = {{15, scale * Eigen::Vector3d(0, 0.1, 0.3), Eigen::Vector3d::Zero(), 0}};
  return conditions;
}

/// Lengths times `unit`, stiffnesses and loads times `force`: the same shape.
Finding twin(double unit, double force) {
  const double bending = force * unit * unit;
  const LinkageModel plain = curved_model();
  const LinkageModel model =
      curved_model(unit, {kStrip.stretching * force, kStrip.bending_1 * bending,
                          kStrip.bending_2 * bending, kStrip.torsion * bending});
  const Shaped here = equilibrium_of(model, opened(force)),
               there = equilibrium_of(plain, opened(1));
  Finding finding = finding_of(here.report, model, here.state);
  finding.error = std::max(
      joint_distance(here.state, there.state, unit) / (unit * kExtent),
      std::abs(here.report.energies.total() / (force * unit) / there.report.energies.total() - 1));
  finding.allowed = kAllowedShape;
  return finding;
}

Finding minimum(const LinkageModel& model, const Conditions& conditions, const Shaped& found) {
  Finding finding = finding_of(found.report, model, found.state);
  finding.allowed = kAllowedGain;
  if (!finding.is_finite || finding.claim == Claim::kNotConverged) return finding;
  const double elastic = std::max(found.report.energies.total() + found.report.spring_energy,
                                  1e-9 * model.stiffness().bending_2 / kExtent);
  finding.error =
      minimum_error(model, found.state, conditions, found.report.mean_angle_moment, elastic);
  finding.message =
      fmt::format("energy {:.4g}. {}", found.report.energies.total(), finding.message);
  return finding;
}

Finding with_stretching(double factor) {
  const LinkageModel model = curved_model(
      1, {factor * kStrip.stretching, kStrip.bending_1, kStrip.bending_2, kStrip.torsion});
  return minimum(model, opened(1), equilibrium_of(model, opened(1)));
}

/// One bending stiffness over the other.
Finding with_ribbon(double ratio) {
  const LinkageModel model = curved_model(
      1, {kStrip.stretching, ratio * kStrip.bending_2, kStrip.bending_2, kStrip.torsion});
  return minimum(model, opened(1), equilibrium_of(model, opened(1)));
}

Finding with_spring(double stiffness) {
  const LinkageModel model = curved_model();
  Conditions conditions;
  conditions.pins = {{0}};
  conditions.springs = {{JointPoint{15},
                         LinkageState(model).joints()[15].position + Eigen::Vector3d(5, 10, 20),
                         stiffness}};
  return minimum(model, conditions, equilibrium_of(model, conditions));
}

Finding with_load(double force) {
  const LinkageModel model = curved_model();
  Conditions conditions;
  conditions.pins = {{5, Hold::kMotionAndAngle}};
  conditions.loads = {{15, force * Eigen::Vector3d(0, 0, 1), Eigen::Vector3d::Zero(), 0}};
  return minimum(model, conditions, equilibrium_of(model, conditions));
}

/// A spring far away takes a floating linkage there without deformation.
Finding carried(double away) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  const EquilibriumReport here = equilibrium.solve(state, {});
  const Eigen::Vector3d target = state.joints()[7].position + Eigen::Vector3d(0, away, 0);
  Conditions conditions;
  conditions.springs = {{JointPoint{7}, target, 1.0}};
  const EquilibriumReport there = equilibrium.solve(state, conditions);
  Finding finding = finding_of(there, model, state);
  finding.error = std::max((state.joints()[7].position - target).norm() / away * 1e5,
                           std::abs(there.energies.total() / here.energies.total() - 1));
  finding.allowed = 1e-3;
  return finding;
}

Shaped gapped(const LinkageModel& model) {
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}};
  conditions.loads = {{11, Eigen::Vector3d(0, 0, -0.5), Eigen::Vector3d::Zero(), 0}};
  return equilibrium_of(model, conditions);
}

Finding with_gap(double gap) {
  const LinkageModel model = gapped_model(gap, 10), wide = gapped_model(1, 10);
  const Shaped found = gapped(model), reference = gapped(wide);
  Finding finding = finding_of(found.report, model, found.state);
  // A fiftieth softer where the gap is 1 and not 0.
  const double share =
      found.state.joints()[11].position.z() / reference.state.joints()[11].position.z();
  finding.error = std::abs(share - (1 - 0.018 * (1 - std::min(gap, 1.0))));
  finding.allowed = 0.03;
  return finding;
}

/// A corner led away from the one that is held, so far [extents]: rods must stretch.
Finding pulled_apart(double share) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions from, to;
  from.pins = {{0}, {15}};
  to = from;
  const Eigen::Vector3d along =
      (state.joints()[15].position - state.joints()[0].position).normalized();
  to.pins[1].position = state.joints()[15].position + share * kExtent * along;
  (void)equilibrium.solve(state, from);
  const DeploymentReport report = deploy(equilibrium, state, from, to);
  const bool is_reached = report.status == DeploymentStatus::kReached;
  Conditions held = to;
  Finding finding = minimum(model, held, {state, report.reached});
  if (!is_reached) {
    finding.claim = Claim::kNotConverged;
    finding.message = report.message;
    return finding;
  }
  finding.error = std::max(finding.error,
                           (state.joints()[15].position - *to.pins[1].position).norm() / kExtent);
  return finding;
}

/// A straight strip pressed between stiff springs, by this share of its length.
Finding pressed(double share) {
  const LinkageModel model = grid_model(6, 2, std::numbers::pi / 2);
  const LinkageState drawn(model);
  Conditions conditions;
  for (const int j : {0, 5, 6, 11}) {
    Eigen::Vector3d target = drawn.joints()[static_cast<std::size_t>(j)].position;
    target.x() = 100 + (1 - share) * (target.x() - 100);
    conditions.springs.push_back({JointPoint{j}, target, 5});
  }
  return minimum(model, conditions, equilibrium_of(model, conditions));
}

Sweep linkage_sweep(const char* name, const char* parameter, std::vector<double> values,
                    int required, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "linkages";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "a curved grid of 16 joints, held at one, opened to a mean of 1 rad under a load";
  sweep.check = "differences of the potential: what a step of Newton's method still gains, inertia";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps linkage_sweeps() {
  Sweep size =
      linkage_sweep("size", "unit of length [mm]", {1, 1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9, 1e-12}, 5,
                    [](double unit) { return twin(unit, 1); });
  size.check = "the same linkage in mm: shape and energy";
  Sweep stiffness = linkage_sweep("stiffness", "all stiffnesses and loads times",
                                  {1, 1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9, 1e-12, 1e12, 1e-15, 1e15}, 5,
                                  [](double force) { return twin(1, force); });
  stiffness.check = size.check;
  Sweep spring =
      linkage_sweep("stiffness of a spring", "N/mm", decades(-12, 12, 3), 7, with_spring);
  spring.asked = "a curved grid held at a joint, and pulled at another by a spring";
  Sweep load = linkage_sweep("load", "N", decades(-9, 6), 10, with_load);
  load.asked = "a curved grid held at a joint, and lifted at another";
  Sweep far = linkage_sweep("far target", "distance [mm]", decades(1, 12), 6, carried);
  far.asked = "a floating grid, carried away by a spring";
  far.check = "the target, and the energy it had";
  Sweep gap = linkage_sweep("short segments", "length [mm], others have 40", decades(0, -9, -1), 3,
                            with_gap);
  gap.asked = "a corner of a grid with short segments, loaded";
  gap.check = "the same corner with segments of 1 mm (limit 3 %)";
  Sweep pull = linkage_sweep("pulled apart", "share of the extent",
                             {1e-4, 1e-3, 1e-2, 0.1, 0.3, 1, 3}, 3, pulled_apart);
  pull.asked = "a pinned joint led away from another pinned one";
  Sweep press = linkage_sweep("a strip that buckles", "shortening",
                              {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.3}, 5, pressed);
  press.asked = "a straight strip of cells pressed between springs";
  return {size,
          stiffness,
          linkage_sweep("slenderness", "EA times", decades(-2, 10), 6, with_stretching),
          linkage_sweep("ribbons", "stiffer over softer bending", decades(0, 8, 1), 4, with_ribbon),
          spring,
          load,
          far,
          gap,
          pull,
          press};
}

}  // namespace limber::bench::stability
