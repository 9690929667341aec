#include "engine/session/bodies/simulation.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/bodies/simulation.h"
#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/length_unit.h"
#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {
namespace {

/// A field over source nodes [scene units] over compact nodes [m]; empty: zero.
Eigen::VectorXd to_compact(const Eigen::VectorXd& source, const MappedBody& mapped,
                           const LengthUnit& unit) {
  const auto count = static_cast<Eigen::Index>(mapped.source_of_compact.size());
  Eigen::VectorXd compact = Eigen::VectorXd::Zero(3 * count);
  for (Eigen::Index node = 0; source.size() > 0 && node < count; ++node) {
    const Eigen::Index from = mapped.source_of_compact[static_cast<std::size_t>(node)];
    compact.segment<3>(3 * node) = unit.to_si(source.segment<3>(3 * from).array()).matrix();
  }
  return compact;
}

/// Modes scaled as scene::InitialState says, times their amplitudes.
Eigen::VectorXd modal_displacement(const std::vector<double>& amplitudes,
                                   const bodies::ElasticBody& body, const LengthUnit& unit,
                                   const JobContext& job) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  if (amplitudes.empty()) return sum;
  bodies::ModalOptions options;
  options.mode_count = static_cast<int>(amplitudes.size());
  const bodies::ModalBasis basis = bodies::modal_analysis(body, options, job);
  for (std::size_t k = 0; k < amplitudes.size(); ++k) {
    const auto mode = basis.modes.col(basis.rigid_count + static_cast<Eigen::Index>(k));
    const double largest = mode.reshaped(3, body.mesh.node_count()).colwise().norm().maxCoeff();
    sum += unit.to_si(amplitudes[k]) / largest * mode;
  }
  return sum;
}

bodies::DynamicState initial_state(const scene::InitialState& initial, const MappedBody& mapped,
                                   const LengthUnit& unit, const JobContext& job) {
  bodies::DynamicState state{to_compact(initial.displacement, mapped, unit),
                             to_compact(initial.velocity, mapped, unit)};
  state.displacement += modal_displacement(initial.modes, mapped.body, unit, job);
  const Eigen::Vector3d common = unit.to_si(initial.common_velocity.array()).matrix();
  state.velocity += common.replicate(mapped.body.mesh.node_count(), 1);
  for (const int node : mapped.body.fixed_nodes) {
    state.displacement.segment<3>(3 * node).setZero();
    state.velocity.segment<3>(3 * node).setZero();
  }
  return state;
}

bodies::Loads map_loads(const scene::Simulation& simulation, const MappedBody& mapped,
                        int frame_count, double frames_per_second) {
  bodies::Loads loads{simulation.gravity, {}};
  for (const scene::NodalForce& force : simulation.forces) {
    bodies::PointForce mapped_force;
    for (const int node : force.nodes)
      mapped_force.nodes.push_back(mapped.compact_of_source.at(static_cast<std::size_t>(node)));
    const double last = frame_count - 1;
    // A force that would begin after the last frame does nothing, for any end.
    const double until =
        std::isfinite(force.until_frame) ? force.until_frame : std::max(last, force.from_frame + 1);
    mapped_force.force = force.force;
    mapped_force.from = force.from_frame / frames_per_second;
    mapped_force.until = until / frames_per_second;
    mapped_force.profile = force.profile;
    if (force.profile == bodies::ForceProfile::kSine)
      mapped_force.period = force.period_frames / frames_per_second;
    loads.forces.push_back(std::move(mapped_force));
  }
  return loads;
}

SimulationReport make_report(bodies::Simulation& result, double frames_per_second) {
  SimulationReport report;
  report.frames_per_second = frames_per_second;
  report.steps = result.steps;
  report.newton_steps = result.newton_steps;
  report.shortened_steps = result.shortened_steps;
  const Eigen::ArrayXd total = (result.kinetic + result.elastic).array();
  const double largest = total.maxCoeff();
  if (largest > 0)
    report.energy_drift = (total - total[0] - result.work.array()).abs().maxCoeff() / largest;
  report.kinetic = std::move(result.kinetic);
  report.elastic = std::move(result.elastic);
  report.work = std::move(result.work);
  report.smallest_volume_ratio = result.smallest_volume_ratio;
  report.smallest_frame = result.smallest_frame;
  report.smallest_tet = result.smallest_tet;
  report.message = std::move(result.message);
  return report;
}

}  // namespace

SimulatedMotion simulate(const scene::Scene& scene, const JobContext& job) {
  if (!scene.simulation) {
    throw Error(ErrorCode::kInvalidArgument, "simulation",
                "the scene says nothing to simulate: it needs a `simulation` with loads or an "
                "initial state");
  }
  const scene::Simulation& simulation = *scene.simulation;
  const LengthUnit unit(scene.length_unit_in_metres);
  job.report("preparing the mesh", 0);
  const MappedBody mapped = map_body(scene);
  bodies::SimulationOptions options;
  options.frame_count = scene.frame_count;
  options.frames_per_second =
      simulation.frames_per_second.value_or(scene.dynamics.frames_per_second);
  options.steps_per_frame = simulation.steps_per_frame;
  options.dynamics.scheme = simulation.scheme;
  options.dynamics.mass_damping = simulation.mass_damping;
  options.dynamics.relaxation_time = simulation.relaxation_time;
  const double modal_part = simulation.initial.modes.empty() ? 0 : 0.1;
  const bodies::DynamicState start =
      initial_state(simulation.initial, mapped, unit, job.part(0, modal_part));
  try {
    bodies::Simulation result = bodies::simulate(
        mapped.body, map_loads(simulation, mapped, scene.frame_count, options.frames_per_second),
        start, options, job.part(modal_part, 1));
    SimulatedMotion motion;
    motion.geometry = rest_geometry(scene, mapped);
    motion.positions = source_positions(scene, mapped, result.displacements);
    motion.report = make_report(result, options.frames_per_second);
    return motion;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kCancelled) throw;
    const std::string at = error.field().empty() ? "" : "." + error.field();
    throw Error(error.code(), "simulation" + at, error.what());
  }
}

}  // namespace limber::session
