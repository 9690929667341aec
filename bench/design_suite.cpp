// Derivatives of designs, and designs towards targets that are known to be reachable.
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <utility>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/equilibrium_sensitivity.h"
#include "engine/rods/design/linkage_cells.h"
#include "engine/rods/design/mesh_surface.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/rest_length_solve.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kPerturbed = 0.03;  // rest lengths of the known design
constexpr double kDistanceWeight = 1e7;

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
  // Closed, a linkage hardly resists opening in its plane, and its shape would say more about that
  // than about its lengths: the flat one is held as open as it is drawn, which takes next to no
  // moment.
  flat.mean_opening_angle = state.mean_opening_angle();
  deployed.mean_opening_angle = named.target * kDegree;
  rods::LinkageState opened = state;
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  (void)rods::deploy(equilibrium, opened, deployed, options);
  return {model, flat, deployed, {model.segment_lengths(), state, opened}};
}

/// Smooth, and of a wavelength about the linkage's size: so that a moved drawing is a drawing.
class Waves {
 public:
  Waves(const rods::LinkageState& state, Random& random) {
    Eigen::AlignedBox3d box;
    for (const auto& joint : state.joints()) box.extend(joint.position);
    for (int axis = 0; axis < 3; ++axis) {
      for (double& k : wave_[axis])
        k = random.uniform(-1, 1) * 2 * std::numbers::pi / box.diagonal().norm();
      phase_[axis] = random.uniform(0, 2 * std::numbers::pi);
    }
    // Flat drawings stay in their plane.
    for (int axis = 0; axis < 3; ++axis)
      amplitude_[axis] = box.sizes()[axis] > 1e-6 * box.diagonal().norm() ? 1 : 0;
  }
  [[nodiscard]] Eigen::Vector3d moved(const Eigen::Vector3d& x, double share) const {
    Eigen::Vector3d result = x;
    for (int axis = 0; axis < 3; ++axis)
      result[axis] += share * amplitude_[axis] * std::sin(wave_[axis].dot(x) + phase_[axis]);
    return result;
  }

 private:
  Eigen::Vector3d wave_[3], phase_, amplitude_;
};

/// Rest lengths of the linkage whose flat shape is moved smoothly, at most by `share` each: what
/// lies flat by itself lies flat again.
Eigen::VectorXd moved_lengths(const Problem& problem, double share) {
  Random random(5);
  const rods::LinkageState& flat = problem.start.flat;
  const Waves waves(flat, random);
  const auto ends = [&](int s) {
    const rods::LinkageModel& model = problem.model;
    const auto& segment = model.graph().segments[static_cast<std::size_t>(s)];
    std::pair<Eigen::Vector3d, Eigen::Vector3d> result;
    for (const rods::End end : {rods::kStart, rods::kFinish}) {
      const int joint = segment.joints[end];
      const int vertex = end == rods::kStart ? 0 : model.variables().edges(s);
      (end == rods::kStart ? result.first : result.second) =
          joint >= 0 ? flat.joints()[static_cast<std::size_t>(joint)].position
                     : flat.vertex(model, s, vertex);
    }
    return result;
  };
  const auto changes = [&](double amplitude) {
    Eigen::VectorXd result(problem.start.lengths.size());
    for (int s = 0; s < result.size(); ++s) {
      const auto [a, b] = ends(s);
      result[s] = (waves.moved(b, amplitude) - waves.moved(a, amplitude)).norm() / (b - a).norm();
    }
    return Eigen::VectorXd(result.array() - 1);
  };
  const double unit = 1e-4 * problem.start.lengths.mean();
  double amplitude = unit * share / changes(unit).cwiseAbs().maxCoeff();
  for (int k = 0; k < 3; ++k) amplitude *= share / changes(amplitude).cwiseAbs().maxCoeff();
  return problem.start.lengths.array() * (1 + changes(amplitude).array());
}

/// A design that is known: both equilibria followed from the start.
struct KnownDesign {
  rods::DesignPoint point;
  bool found = true;
};
KnownDesign known_design(const Problem& problem, double share) {
  rods::LinkageModel model = problem.model;
  rods::LinkageEquilibrium equilibrium(model);
  KnownDesign known{problem.start};
  const Eigen::VectorXd other = moved_lengths(problem, share);
  constexpr int kSteps = 20;
  for (int k = 1; k <= kSteps; ++k) {
    known.point.lengths =
        problem.start.lengths + static_cast<double>(k) / kSteps * (other - problem.start.lengths);
    model.set_segment_lengths(known.point.lengths);
    known.found = equilibrium.solve(known.point.flat, problem.flat).converged() && known.found;
    known.found =
        equilibrium.solve(known.point.deployed, problem.deployed).converged() && known.found;
  }
  return known;
}

Eigen::Matrix3Xd positions(const rods::LinkageState& state) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(state.joints().size()));
  for (std::size_t j = 0; j < state.joints().size(); ++j)
    result.col(static_cast<Eigen::Index>(j)) = state.joints()[j].position;
  return result;
}

/// Of sizes one by one: what presses rods of the flat shape at once.
Eigen::VectorXd random_way(const rods::LinkageDesign& design) {
  Random random(11);
  Eigen::VectorXd v(design.parameters().size());
  for (double& value : v) value = random.normal();
  return v;
}

/// To the known design: with the flat shape flat, as the ways of designs are.
Eigen::VectorXd known_way(const Problem& problem, const KnownDesign& known,
                          const rods::LinkageDesign& design) {
  rods::LinkageModel model = problem.model;
  model.set_segment_lengths(known.point.lengths);
  return design.variables().values(model) - design.parameters();
}

/// Against differences of equilibria solved again, relative.
/// @param v  along which
/// @param kind  ends the names of the results
void check(rods::LinkageDesign& design, Eigen::VectorXd v, const std::string& kind, Case& result) {
  const rods::DesignPoint home = design.point();
  const Eigen::VectorXd parameters = design.parameters();
  v *= parameters.mean() / v.norm();
  const rods::DesignMeasures<Eigen::VectorXd> gradients = design.gradients();
  const Eigen::VectorXd product = design.products(v).objective;
  result["gradient_check" + kind] = nullptr;
  result["hessvec_check" + kind] = nullptr;
  double best_gradient = 1, best_product = 1;
  for (const double step : {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 5e-5, 3e-5, 1e-5, 1e-6}) {
    std::vector<rods::DesignPoint> points;
    for (const double side : {2.0, 1.0, -1.0, -2.0}) {
      const rods::DesignTrial trial = design.trial(parameters + side * step * v);
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
  if (best_gradient < 1) result["gradient_check" + kind] = best_gradient;
  if (best_product < 1) result["hessvec_check" + kind] = best_product;
}

/// As the optimiser asks: a trial nearby, its objective, and at the trial's point, with the factors
/// that certified its equilibria, the objective's gradient and products (as the public code's), and
/// the gradients of both constraints.
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

/// What the factors would cost that trials leave: both Hessians assembled and factored once more.
void measure_factors(const Problem& problem, int repeats, Case& result) {
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

Case measure(const LinkageCase& named, const std::string& path, const SuiteOptions& options) {
  const Problem problem = open(named, path);
  Case result;
  result["model"] = named.name;
  result["parameters"] = problem.start.lengths.size();
  result["threads"] = thread_count();
  const KnownDesign known = known_design(problem, kPerturbed);
  rods::DesignCriteria criteria;
  criteria.surface = std::make_shared<rods::MeshSurface>(
      rods::surface_through_joints(problem.model.graph(), positions(known.point.deployed)));
  criteria.distance_weight = kDistanceWeight;
  result["target_found"] = known.found;
  rods::DesignLimits limits;
  rods::LinkageDesign design(problem.model, problem.flat, problem.deployed, problem.start, criteria,
                             limits);
  // A part of the way to the known design, as the first steps of a search are.
  measure_derivatives(design, 0.01 * known_way(problem, known, design), options.quick ? 3 : 9,
                      result);
  measure_factors(problem, options.quick ? 3 : 9, result);
  check(design, known_way(problem, known, design), "", result);
  check(design, random_way(design), "_random", result);
  for (const auto& [kind, variables] :
       {std::pair{"_edges", rods::DesignVariables{rods::LengthVariables::kEdges, {}}},
        std::pair{"_sections", rods::DesignVariables{rods::LengthVariables::kKept,
                                                     rods::SectionVariables::kSegments}}}) {
    rods::LinkageDesign other(problem.model, problem.flat, problem.deployed, problem.start,
                              criteria, limits, variables);
    const bool lengths = variables.lengths != rods::LengthVariables::kKept;
    check(other, lengths ? known_way(problem, known, other) : random_way(other), kind, result);
  }
  rods::DesignOptimizerOptions search;
  const rods::DesignValues before = design.values(design.point());
  const double joints = problem.model.variables().joints();
  search.flat_height =
      1.2 * std::sqrt(before.flatness / joints) / design.criteria().length_scale + 1e-3;
  search.smallest_angle = before.smallest_angle - 5 * kDegree;
  search.max_iterations = options.quick ? 20 : 200;
  search.guard = rods::BucklingGuard::kFromStart;
  rods::DesignReport report;
  const double wall = milliseconds([&] { report = rods::optimize_design(design, search); });
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
  const rods::DesignValues wanted = design.values(known.point);
  result["known_flatness"] = std::sqrt(wanted.flatness / joints) / design.criteria().length_scale;
  result["known_min_angle"] = wanted.smallest_angle / kDegree;
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
