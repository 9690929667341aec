#include "bench/known_designs.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/rods/design/linkage_cells.h"
#include "engine/rods/design/mesh_surface.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/rest_length_solve.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

constexpr double kDistanceWeight = 1e7;

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

/// Rest lengths of the linkage whose flat shape is moved smoothly, at most by `share` each: a shape
/// that lies flat by itself lies flat again.
Eigen::VectorXd moved_lengths(const DesignProblem& problem, double share) {
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

}  // namespace

void for_each_design(
    const SuiteOptions& options, Recorder& recorder,
    const std::function<void(const LinkageCase& named, const std::string& path)>& measure) {
  for (const LinkageCase& named : linkage_cases()) {
    if (named.known_wall == 0) continue;  // burd at other subdivisions
    if (!is_selected(named.name)) continue;
    const auto path = find_linkage_lines(options, named.name, named.file, recorder);
    if (!path) continue;
    try {
      measure(named, *path);
    } catch (const Error& error) {
      recorder.note(fmt::format("{}: {} {}", named.name, error.field(), error.what()));
    }
  }
}

DesignProblem open_design(const LinkageCase& named, const std::string& path) {
  // In the public code's form of bending, whose figures the suites compare with.
  rods::LinkageModel model(rods::build_linkage_graph(scene::read_line_mesh_file(path)), named.edges,
                           named.stiffness, rods::BendingForm::kMaterialFrames);
  rods::LinkageState state(model);
  rods::Conditions flat, deployed;
  flat.pins = {{named.held}};
  if (named.rest_lengths == RestLengthChoice::kSolved) (void)rods::solve_rest_lengths(model, state);
  rods::LinkageEquilibrium equilibrium(model);
  (void)equilibrium.solve(state, flat);
  deployed = flat;
  // A closed linkage hardly resists opening in its plane, and its shape would depend more on that
  // than on its lengths. The flat one is therefore held as open as it is drawn, with nearly no
  // moment.
  flat.mean_opening_angle = state.mean_opening_angle();
  deployed.mean_opening_angle = named.target * kDegree;
  rods::LinkageState opened = state;
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  (void)rods::deploy(equilibrium, opened, deployed, options);
  return {model, flat, deployed, {model.segment_lengths(), state, opened}};
}

KnownDesign known_design(const DesignProblem& problem, double share) {
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

rods::LinkageDesign design_towards(const KnownDesign& known, const DesignProblem& problem) {
  rods::DesignCriteria criteria;
  criteria.surface = std::make_shared<rods::MeshSurface>(rods::surface_through_joints(
      problem.model.graph(), rods::joint_positions(known.point.deployed)));
  criteria.distance_weight = kDistanceWeight;
  return {problem.model, problem.flat, problem.deployed, problem.start, std::move(criteria)};
}

rods::DesignOptimizerOptions known_search(rods::LinkageDesign& design, int steps) {
  rods::DesignOptimizerOptions search;
  const rods::DesignValues start = design.values(design.point());
  const double joints = design.model().variables().joints();
  search.flat_height =
      1.2 * std::sqrt(start.flatness / joints) / design.criteria().length_scale + 1e-3;
  search.smallest_angle = start.smallest_angle - 5 * kDegree;
  search.max_iterations = steps;
  search.guard = rods::BucklingGuard::kFromStart;
  return search;
}

}  // namespace limber::bench
