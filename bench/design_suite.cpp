// Derivatives of designs, and designs towards targets that are known to be reachable.
#include <fmt/core.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "bench/design_checks.h"
#include "bench/design_trace.h"
#include "bench/known_designs.h"
#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/equilibrium_sensitivity.h"
#include "engine/rods/design/principal_axes.h"
#include "engine/rods/linkage/joint_positions.h"

namespace limber::bench {
namespace {

/// Time of the calling thread.
template <class Work>
double cpu_milliseconds(const Work& work) {
  const double start = thread_seconds();
  work();
  return 1e3 * (thread_seconds() - start);
}

/// Direction of single sizes that presses rods of the flat shape at once.
Eigen::VectorXd random_direction(const rods::LinkageDesign& design) {
  Random random(11);
  Eigen::VectorXd v(design.parameters().size());
  for (double& value : v) value = random.normal();
  return v;
}

/// To the known design: with the flat shape flat, as the steps of designs are.
Eigen::VectorXd known_direction(const DesignProblem& problem, const KnownDesign& known,
                                const rods::LinkageDesign& design) {
  rods::LinkageModel model = problem.model;
  model.set_segment_lengths(known.point.lengths);
  return design.variables().values(model) - design.parameters();
}

/// Requests of the optimiser: a trial nearby, its objective, and derivatives at the trial's point,
/// with the factors that certified its equilibria. The derivatives are the objective's gradient and
/// products (as the public code's), and the gradients of both constraints.
/// @param v  where the trial goes to
void measure_derivatives(rods::LinkageDesign& design, const Eigen::VectorXd& v, int repeats,
                         Case& result) {
  using Which = rods::LinkageDesign::Which;
  const rods::DesignPoint home = design.point();
  std::vector<double> objective, gradient, constraints, product;
  bool found = true;
  int anew = 0;
  for (int k = 0; k < repeats; ++k) {
    design.move_to(home);
    (void)design.gradients();
    std::optional<rods::DesignTrial> trial;
    objective.push_back(milliseconds([&] {
      trial = design.trial(home.lengths + v);
      (void)design.values(trial->point);
    }));
    found = found && trial->status == rods::TrialStatus::kFound;
    const int before = design.factored_anew();
    design.move_to(std::move(trial->point));
    gradient.push_back(milliseconds([&] { (void)design.gradients(Which::kObjective); }));
    anew += design.factored_anew() - before;
    constraints.push_back(milliseconds([&] { (void)design.gradients(Which::kAll); }));
    product.push_back(milliseconds([&] { (void)design.products(v, Which::kObjective); }));
  }
  result["factored_anew"] = anew;
  design.move_to(home);
  result["objective_ms"] = median(objective);
  result["gradient_ms"] = median(gradient);
  result["gradient_constraints_ms"] = median(constraints);
  result["hessvec_ms"] = median(product);
  result["trials_found"] = found;
}

/// CPU time of repeated calls, the least of all: one thread's, so that waiting counts for nothing.
void measure_cpu(rods::LinkageDesign& design, const Eigen::VectorXd& v, int repeats, Case& result) {
  using Which = rods::LinkageDesign::Which;
  const int threads = thread_count();
  set_thread_count(1);
  const rods::DesignCriteria criteria = design.criteria();
  double gradient = std::numeric_limits<double>::infinity(), product = gradient;
  for (int k = 0; k < repeats; ++k) {
    design.set_criteria(criteria);  // forgets previous requests
    (void)design.values(design.point());
    gradient =
        std::min(gradient, cpu_milliseconds([&] { (void)design.gradients(Which::kObjective); }));
    product =
        std::min(product, cpu_milliseconds([&] { (void)design.products(v, Which::kObjective); }));
  }
  set_thread_count(threads);
  result["gradient_cpu_ms"] = gradient;
  result["hessvec_cpu_ms"] = product;
}

/// Cost of the factors that trials leave: both Hessians assembled and factored once more.
void measure_factors(const DesignProblem& problem, int repeats, Case& result) {
  rods::LinkageModel model = problem.model;
  rods::set_sizes(model, problem.start);
  rods::EquilibriumSensitivity flat(model, problem.start.flat, problem.flat);
  rods::EquilibriumSensitivity deployed(model, problem.start.deployed, problem.deployed);
  std::vector<double> factors;
  for (int k = 0; k < repeats; ++k) {
    factors.push_back(milliseconds([&] {
      flat.move_to(problem.start.flat);
      deployed.move_to(problem.start.deployed);
    }));
  }
  result["factor_ms"] = median(factors);
}

/// Through the flat joints, aslant to the plane that they lie in: flatness is nothing over that
/// one, and so are its derivatives.
rods::Plane aslant(const rods::LinkageState& flat) {
  const Eigen::Matrix3Xd joints = rods::joint_positions(flat);
  const Eigen::Vector3d normal = rods::principal_axes(joints) * Eigen::Vector3d(1, 0.02, 0.01);
  return {joints.rowwise().mean(), normal.normalized()};
}

/// Against differences, along the direction to the known design and along random ones.
void check_all_derivatives(const DesignProblem& problem, const KnownDesign& known,
                           rods::LinkageDesign& design, bool quick, Case& result) {
  const rods::DesignCriteria judged = design.criteria();
  rods::DesignCriteria criteria = judged;
  criteria.plane = aslant(problem.start.flat);
  criteria.least_area = design.values(design.point()).deployed_area;  // else it has no derivatives
  design.set_criteria(criteria);
  check_derivatives(design, known_direction(problem, known, design), quick, "", result);
  check_derivatives(design, random_direction(design), quick, "_random", result);
  design.set_criteria(judged);
  if (quick) return;
  for (const auto& [kind, variables] :
       {std::pair{"_edges", rods::DesignVariables{rods::LengthVariables::kEdges, {}}},
        std::pair{"_sections", rods::DesignVariables{rods::LengthVariables::kKept,
                                                     rods::SectionVariables::kSegments}}}) {
    rods::LinkageDesign other(problem.model, problem.flat, problem.deployed, problem.start,
                              criteria, {}, variables);
    const bool lengths = variables.lengths != rods::LengthVariables::kKept;
    check_derivatives(other,
                      lengths ? known_direction(problem, known, other) : random_direction(other),
                      quick, kind, result);
  }
}

/// From the start towards the known design.
void measure_search(const KnownDesign& known, rods::LinkageDesign& design, int steps,
                    const std::function<void(const std::string&)>& tell, Case& result) {
  const rods::DesignOptimizerOptions search = known_search(design, steps);
  const double joints = design.model().variables().joints();
  rods::DesignReport report;
  constexpr int kReportInterval = 20;  // every so many steps
  const auto on_step = [&](const rods::DesignProgress& progress, rods::LinkageDesign&) {
    if (progress.iteration % kReportInterval != 0) return;
    tell(fmt::format("step {} of {}, joints {:.3g} from the target", progress.iteration, steps,
                     std::sqrt(2 * progress.values.distance / joints)));
  };
  const double wall =
      milliseconds([&] { report = rods::optimize_design(design, search, {}, on_step); });
  result["iterations"] = report.iterations;
  result["not_believed"] = report.not_believed;
  result["products"] = report.products;
  result["wall_s"] = wall / 1000;
  result["target_rms_before"] = std::sqrt(2 * report.before.distance / joints);
  result["target_rms_after"] = std::sqrt(2 * report.after.distance / joints);
  result["factor"] = std::sqrt(report.before.distance / report.after.distance);
  result["flatness"] = report.flat_height;
  result["flatness_asked"] = search.flat_height;
  result["min_angle"] = report.after.smallest_angle / kDegree;
  result["min_angle_asked"] = search.smallest_angle / kDegree;
  result["newton_steps"] = report.newton_steps;
  const rods::DesignValues expected = design.values(known.point);
  result["known_flatness"] = std::sqrt(expected.flatness / joints) / design.criteria().length_scale;
  result["known_min_angle"] = expected.smallest_angle / kDegree;
  result["status"] = static_cast<int>(report.status);
}

Case measure_design(const LinkageCase& named, const std::string& path, const SuiteOptions& options,
                    Recorder& recorder) {
  const auto tell = [&](const std::string& what) {
    recorder.note(fmt::format("design: {}: {}", named.name, what));
  };
  tell("opens, and moves to a known design");
  const DesignProblem problem = open_design(named, path);
  Case result;
  result["model"] = named.name;
  result["parameters"] = problem.start.lengths.size();
  result["threads"] = thread_count();
  const KnownDesign known = known_design(problem, kPerturbed);
  result["target_found"] = known.found;
  rods::LinkageDesign design = design_towards(known, problem);
  tell("derivatives, timed");
  // A part of the step to the known design, as the first steps of a search are.
  const Eigen::VectorXd direction = 0.01 * known_direction(problem, known, design);
  const int repeats = options.quick ? 3 : 9;
  measure_derivatives(design, direction, repeats, result);
  measure_cpu(design, direction, options.quick ? 20 : 100, result);
  measure_factors(problem, repeats, result);
  tell("derivatives against differences");
  check_all_derivatives(problem, known, design, options.quick, result);
  measure_search(known, design, options.quick ? 10 : 200, tell, result);
  return result;
}

}  // namespace

void design_suite(const SuiteOptions& options, Recorder& recorder) {
  for_each_design(options, recorder, [&](const LinkageCase& named, const std::string& path) {
    recorder.add(measure_design(named, path, options, recorder));
  });
}

}  // namespace limber::bench
