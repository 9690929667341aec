// Derivatives of designs, and designs towards targets that are known to be reachable.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/rest_length_solve.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kPerturbed = 0.03;  // rest lengths of the known design

struct Problem {
  rods::LinkageModel model;
  rods::Conditions flat, deployed;
  rods::DesignPoint start;
};

Problem open(const LinkageCase& named, const std::string& path) {
  rods::LinkageModel model(rods::build_linkage_graph(scene::read_line_mesh_file(path)), named.edges,
                           named.stiffness);
  rods::LinkageState state(model);
  rods::Conditions flat, deployed;
  flat.pins = {{named.held}};
  if (named.rest_lengths == RestLengthChoice::kSolved) (void)rods::solve_rest_lengths(model, state);
  rods::LinkageEquilibrium equilibrium(model);
  (void)equilibrium.solve(state, flat);
  deployed = flat;
  deployed.mean_opening_angle = named.target * kDegree;
  rods::LinkageState opened = state;
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  (void)rods::deploy(equilibrium, opened, deployed, options);
  return {model, flat, deployed, {model.segment_lengths(), state, opened}};
}

/// Joints of the linkage deployed with other rest lengths, as targets. What it does when it is flat
/// with these does not matter.
std::vector<rods::JointTarget> known_targets(const Problem& problem, double share, bool& found) {
  rods::LinkageModel model = problem.model;
  rods::LinkageEquilibrium equilibrium(model);
  rods::LinkageState state = problem.start.deployed;
  Random random(5);
  const Eigen::VectorXd lengths = problem.start.lengths;
  Eigen::VectorXd other = lengths;
  for (double& length : other) length *= random.uniform(1 - share, 1 + share);
  constexpr int kSteps = 20;
  found = true;
  for (int k = 1; k <= kSteps; ++k) {
    model.set_segment_lengths(lengths + static_cast<double>(k) / kSteps * (other - lengths));
    found = equilibrium.solve(state, problem.deployed).converged() && found;
  }
  std::vector<rods::JointTarget> targets;
  for (int j = 0; j < model.variables().joints(); ++j)
    targets.push_back({j, state.joints()[static_cast<std::size_t>(j)].position, 1});
  return targets;
}

/// Against differences of equilibria solved again, relative.
void check(rods::LinkageDesign& design, Case& result) {
  const rods::DesignPoint home = design.point();
  Random random(11);
  Eigen::VectorXd v(home.lengths.size());
  for (double& value : v) value = random.normal();
  v *= home.lengths.mean() / v.norm();
  const rods::DesignMeasures<Eigen::VectorXd> gradients = design.gradients();
  const Eigen::VectorXd product = design.products(v).objective;
  result["gradient_check"] = nullptr;
  result["hessvec_check"] = nullptr;
  double best_gradient = 1, best_product = 1;
  for (const double step : {1e-3, 3e-4, 1e-4, 3e-5}) {
    std::vector<rods::DesignPoint> points;
    for (const double side : {2.0, 1.0, -1.0, -2.0}) {
      const rods::DesignTrial trial = design.trial(home.lengths + side * step * v);
      if (trial.status != rods::TrialStatus::kFound) break;
      points.push_back(trial.point);
    }
    if (points.size() < 4) continue;
    double values[4];
    Eigen::VectorXd sides[4];
    for (int k = 0; k < 4; ++k) {
      values[k] = design.values(points[static_cast<std::size_t>(k)]).objective;
      design.move_to(points[static_cast<std::size_t>(k)]);
      sides[k] = design.gradients().objective;
    }
    design.move_to(home);
    const double slope = (8 * (values[1] - values[2]) - (values[0] - values[3])) / (12 * step);
    best_gradient = std::min(best_gradient, std::abs(slope - gradients.objective.dot(v)) /
                                                (gradients.objective.norm() * v.norm()));
    const Eigen::VectorXd difference =
        (8 * (sides[1] - sides[2]) - (sides[0] - sides[3])) / (12 * step);
    best_product = std::min(best_product, (difference - product).norm() / product.norm());
  }
  if (best_gradient < 1) result["gradient_check"] = best_gradient;
  if (best_product < 1) result["hessvec_check"] = best_product;
}

void measure_derivatives(rods::LinkageDesign& design, int repeats, Case& result) {
  const rods::DesignPoint home = design.point();
  const Eigen::VectorXd v =
      Eigen::VectorXd::LinSpaced(home.lengths.size(), -1e-4, 1e-4) * home.lengths.mean();
  std::vector<double> objective, gradient, product;
  for (int k = 0; k < repeats; ++k) {
    design.move_to(home);
    gradient.push_back(milliseconds([&] { (void)design.gradients(); }));
    // As the public code's: the objective's alone.
    product.push_back(
        milliseconds([&] { (void)design.products(v, rods::LinkageDesign::Products::kObjective); }));
    objective.push_back(milliseconds([&] {
      const rods::DesignTrial trial = design.trial(home.lengths + v);
      (void)design.values(trial.point);
    }));
  }
  result["objective_ms"] = median(objective);
  result["gradient_ms"] = median(gradient);
  result["hessvec_ms"] = median(product);
}

Case measure(const LinkageCase& named, const std::string& path, const SuiteOptions& options) {
  const Problem problem = open(named, path);
  Case result;
  result["model"] = named.name;
  result["parameters"] = problem.start.lengths.size();
  result["threads"] = thread_count();
  bool found = false;
  rods::DesignCriteria criteria;
  criteria.targets = known_targets(problem, kPerturbed, found);
  criteria.distance_weight = 1e7;
  result["target_found"] = found;
  rods::DesignLimits limits;
  rods::LinkageDesign design(problem.model, problem.flat, problem.deployed, problem.start, criteria,
                             limits);
  measure_derivatives(design, options.quick ? 3 : 9, result);
  check(design, result);
  rods::DesignOptimizerOptions search;
  const rods::DesignValues before = design.values(design.point());
  const double joints = problem.model.variables().joints();
  search.flat_height =
      1.2 * std::sqrt(before.flatness / joints) / design.criteria().length_scale + 1e-3;
  search.smallest_angle = before.smallest_angle - 5 * kDegree;
  search.max_iterations = options.quick ? 20 : 100;
  rods::DesignReport report;
  const double wall = milliseconds([&] { report = rods::optimize_design(design, search); });
  result["iterations"] = report.iterations;
  result["not_believed"] = report.not_believed;
  result["products"] = report.products;
  result["wall_s"] = wall / 1000;
  result["target_rms_before"] = std::sqrt(2 * report.before.distance / joints);
  result["target_rms_after"] = std::sqrt(2 * report.after.distance / joints);
  result["flatness"] = report.flat_height;
  result["flatness_asked"] = search.flat_height;
  result["min_angle"] = report.after.smallest_angle / kDegree;
  result["min_angle_asked"] = search.smallest_angle / kDegree;
  result["status"] = static_cast<int>(report.status);
  return result;
}

}  // namespace

void design_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const LinkageCase& named : linkage_cases()) {
    const std::string path = options.shared_folder + "/data/linkages/" + named.file + ".obj";
    if (named.known_wall == 0) continue;  // burd at other subdivisions
    if (options.shared_folder.empty() || !std::filesystem::exists(path)) {
      recorder.note(fmt::format("{} left out: {} is not there", named.name, path));
      continue;
    }
    try {
      recorder.add(measure(named, path, options));
    } catch (const Error& error) {
      recorder.note(fmt::format("{}: {} {}", named.name, error.field(), error.what()));
    }
  }
}

}  // namespace limber::bench
