// Linkages from the drawn shape to the deployed one, as the public code's measured runs do it.
// $LIMBER_BENCH_ONLY: only linkages whose names contain it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/base/parallel.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/discretisation_error.h"
#include "engine/rods/equilibrium/rest_length_solve.h"
#include "engine/rods/linkage/drawn_extent.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/solver/condensed_solver.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

/// Medians of the parts of one Newton step at a state.
void measure_parts(const rods::LinkageModel& model, const rods::LinkageState& state, int repeats,
                   Case& result) {
  rods::LinkageAssembly assembly(model);
  rods::CondensedMatrix matrix(model.chains());
  rods::CondensedSolver solver(model.chains());
  Eigen::VectorXd gradient(model.variables().size());
  std::vector<double> hessian;
  std::vector<double> factorization;
  for (int k = 0; k < repeats; ++k) {
    hessian.push_back(milliseconds([&] { (void)assembly.hessian(state, gradient, matrix); }));
    factorization.push_back(milliseconds([&] { (void)solver.factor(matrix, 1e-9); }));
  }
  result["hessian_ms"] = median(hessian);
  result["factorization_ms"] = median(factorization);
}

/// Medians of a gradient, and of derivatives along directions: a Hessian-vector product, the same
/// with rest lengths, third derivatives by duals, and D^3 E[v, v] by two gradients.
void measure_derivatives(const rods::LinkageModel& model, const rods::LinkageState& state,
                         int repeats, Case& result) {
  rods::LinkageAssembly assembly(model);
  rods::LinkageDerivatives derivatives(model);
  Eigen::VectorXd gradient(model.variables().size());
  const Eigen::VectorXd step = Eigen::VectorXd::LinSpaced(gradient.size(), -1e-3, 1e-3);
  const rods::LinkageVector x{step, {}};
  const rods::LinkageVector both{step, model.segment_lengths()};
  const auto time = [&](const char* name, const auto& work) {
    std::vector<double> times;
    for (int k = 0; k < repeats; ++k) times.push_back(milliseconds(work));
    result[name] = median(times);
  };
  time("gradient_ms", [&] { (void)assembly.gradient(state, gradient); });
  time("product_ms", [&] { (void)derivatives.second({state}, x); });
  time("product_with_lengths_ms", [&] { (void)derivatives.second({state}, both); });
  time("third_ms", [&] { (void)derivatives.third({state}, both, both); });
  time("third_by_differences_ms", [&] {
    for (const double side : {1.0, -1.0})
      (void)assembly.gradient(state.moved(model, side * step), gradient);
  });
}

/// Median time to the next equilibrium after one of two springs has moved, by a step to and fro.
void measure_retarget(const rods::LinkageModel& model, rods::LinkageEquilibrium& equilibrium,
                      rods::LinkageState state, const rods::Conditions& deployed, int repeats,
                      Case& result) {
  rods::Conditions conditions = deployed;
  const int joints = model.variables().joints();
  const double edge = model.rest_lengths().free_edge.mean();
  const double stiffness = 3 * std::min(model.stiffness().bending_1, model.stiffness().bending_2) /
                           std::pow(10 * edge, 3);
  for (const int joint : {joints / 4, 3 * joints / 4})
    conditions.springs.push_back(
        {rods::JointPoint{joint}, state.joints()[joint].position, stiffness});
  bool converged = equilibrium.solve(state, conditions).converged();
  const Eigen::Vector3d home = conditions.springs[0].position;
  std::vector<double> times;
  std::vector<double> iterations;
  for (int k = 0; k < repeats; ++k) {
    conditions.springs[0].position = home + Eigen::Vector3d(0, 0, k % 2 == 0 ? edge : 0);
    times.push_back(milliseconds([&] {
      const rods::EquilibriumReport report = equilibrium.solve(state, conditions);
      converged = converged && report.converged();
      iterations.push_back(report.iterations);
    }));
  }
  result["retarget_ms"] = median(times);
  result["retarget_iterations"] = median(iterations);
  result["retarget_failed"] = !converged;
}

/// Rest lengths of the public code's "solve" runs.
void solve_lengths(const LinkageCase& named, rods::LinkageModel& model, rods::LinkageState& state,
                   Case& result) {
  for (const char* name : {"rest_lengths_ms", "rest_length_iterations", "rest_lengths_failed"})
    result[name] = nullptr;
  if (named.rest_lengths == RestLengthChoice::kDrawn) return;
  rods::RestLengthReport report;
  result["rest_lengths_ms"] =
      milliseconds([&] { report = rods::solve_rest_lengths(model, state); });
  result["rest_length_iterations"] = report.iterations;
  result["rest_lengths_failed"] = !report.converged();
}

/// The same deployment again and again, from the same closed state.
/// @param state  closed; deployed afterwards
rods::DeploymentReport measure_deployment(const LinkageCase& named,
                                          rods::LinkageEquilibrium& equilibrium,
                                          rods::LinkageState& state,
                                          const rods::Conditions& conditions, int repeats,
                                          Case& result) {
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  const rods::LinkageState closed = state;
  rods::DeploymentReport report;
  std::vector<double> walls;
  for (int k = 0; k < repeats; ++k) {
    state = closed;
    walls.push_back(
        milliseconds([&] { report = rods::deploy(equilibrium, state, conditions, options); }));
  }
  const double wall = median(walls);
  result["steps"] = report.steps;
  result["steps_failed"] = report.steps_failed;
  result["jumps"] = report.jumps;
  result["iterations"] = report.iterations;
  result["wall_s"] = wall / 1000;
  result["wall_least_s"] = *std::min_element(walls.begin(), walls.end()) / 1000;
  result["wall_most_s"] = *std::max_element(walls.begin(), walls.end()) / 1000;
  result["ms_per_iteration"] = wall / report.iterations;
  result["wall_ratio"] = result["iteration_ratio"] = nullptr;
  if (named.known_wall > 0) {
    result["wall_ratio"] = named.known_wall * 1000 / wall;
    result["iteration_ratio"] = named.known_ms * report.iterations / wall;
  }
  return report;
}

/// Error of the edges for the deployed shape, and the time to estimate it; the model with half
/// edges exists already.
void measure_discretisation(const rods::LinkageModel& model, const rods::LinkageState& state,
                            const rods::Conditions& conditions, int repeats, Case& result) {
  rods::DiscretisationEstimator estimator(model);
  rods::DiscretisationError error;
  std::vector<double> times;
  for (int k = 0; k < repeats; ++k)
    times.push_back(milliseconds([&] { error = estimator.estimate(model, state, conditions); }));
  result["position_error"] = result["energy_error"] = nullptr;
  if (error.is_known()) {
    result["position_error"] = error.max_distance / rods::drawn_extent(model.graph());
    result["energy_error"] = error.energy_error;
  }
  result["estimate_iterations"] = error.iterations;
  result["estimate_ms"] = median(times);
}

/// Results of the public code are of its own form of bending: the known energies and times of a
/// case are left out in another.
Case measure_linkage(LinkageCase named, rods::BendingForm form, const std::string& path,
                     const SuiteOptions& options) {
  rods::LinkageModel model(rods::build_linkage_graph(scene::read_line_mesh_file(path)), named.edges,
                           named.stiffness, form);
  const bool is_of_public_code = form == rods::BendingForm::kMaterialFrames;
  if (!is_of_public_code)
    named.known_closed = named.known_energy = named.known_ms = named.known_wall = 0;
  rods::LinkageState state(model);
  rods::Conditions conditions;
  conditions.pins = {{named.held}};
  Case result;
  result["model"] = named.name;
  result["bending"] = is_of_public_code ? "material frames" : "turning angle";
  solve_lengths(named, model, state, result);
  rods::LinkageEquilibrium equilibrium(model);
  result["dofs"] = model.variables().size();
  result["threads"] = thread_count();
  rods::EquilibriumReport closed;
  result["closing_ms"] = milliseconds([&] { closed = equilibrium.solve(state, conditions); });
  result["closing_failed"] = !closed.converged();
  result["energy_closed"] = closed.energies.total();
  result["energy_closed_difference"] = nullptr;
  if (named.known_closed > 0)
    result["energy_closed_difference"] = std::abs(closed.energies.total() / named.known_closed - 1);
  conditions.mean_opening_angle = named.target * kDegree;
  const rods::DeploymentReport report =
      measure_deployment(named, equilibrium, state, conditions, options.repeats, result);
  measure_parts(model, state, options.quick ? 5 : 21, result);
  measure_derivatives(model, state, options.quick ? 5 : 21, result);
  result["energy_deployed"] = report.end.energies.total();
  result["max_gradient_scaled"] = report.end.max_gradient_scaled;
  if (named.known_energy > 0) {
    result["energy_difference"] = std::abs(report.end.energies.total() / named.known_energy - 1);
  } else {
    result["energy_difference"] = nullptr;
  }
  measure_discretisation(model, state, conditions, options.repeats, result);
  measure_retarget(model, equilibrium, state, conditions, options.quick ? 4 : 12, result);
  return result;
}

}  // namespace

void linkage_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const LinkageCase& named : linkage_cases()) {
    if (!is_selected(named.name)) continue;
    const auto path = find_linkage_lines(options, named.name, named.file, recorder);
    if (!path) continue;
    for (const auto form : {rods::BendingForm::kMaterialFrames, rods::BendingForm::kTurningAngle})
      recorder.add(measure_linkage(named, form, *path, options));
  }
}

}  // namespace limber::bench
