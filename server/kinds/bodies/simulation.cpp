#include "server/kinds/bodies/simulation.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

constexpr int kOutOfRange = std::numeric_limits<int>::max();

constexpr EnumTable<bodies::ForceProfile, proto::ForceProfile, proto::ForceProfile_MAX>
    kForceProfiles{{bodies::ForceProfile::kConstant, proto::FORCE_PROFILE_CONSTANT},
                   {bodies::ForceProfile::kRamp, proto::FORCE_PROFILE_RAMP},
                   {bodies::ForceProfile::kSine, proto::FORCE_PROFILE_SINE}};

constexpr EnumTable<bodies::TimeStepping, proto::TimeStepping, proto::TimeStepping_MAX>
    kTimeSteppings{
        {bodies::TimeStepping::kImplicitMidpoint, proto::TIME_STEPPING_IMPLICIT_MIDPOINT},
        {bodies::TimeStepping::kImplicitEuler, proto::TIME_STEPPING_IMPLICIT_EULER}};

scene::NodalForce decode_force(const proto::NodalForce& message, const std::string& field,
                               Faults& faults) {
  scene::NodalForce force;
  force.nodes.assign(static_cast<std::size_t>(message.nodes_size()), kOutOfRange);
  faults.try_each(field + ".nodes", message.nodes_size(), [&](int i) {
    force.nodes[static_cast<std::size_t>(i)] =
        decode_index(message.nodes(i), fmt::format("{}.nodes[{}]", field, i));
  });
  force.force = decode_vector(message.force());
  force.from_frame = message.from_frame();
  if (message.has_until_frame()) force.until_frame = message.until_frame();
  force.profile = kForceProfiles.decode(message.profile());
  if (message.has_period_frames()) force.period_frames = message.period_frames();
  return force;
}

proto::NodalForce encode_force(const scene::NodalForce& force) {
  proto::NodalForce message;
  for (const int node : force.nodes) message.add_nodes(static_cast<std::uint32_t>(node));
  encode_vector(force.force, *message.mutable_force());
  message.set_from_frame(force.from_frame);
  if (std::isfinite(force.until_frame)) message.set_until_frame(force.until_frame);
  message.set_profile(kForceProfiles.encode(force.profile));
  if (force.period_frames != 0) message.set_period_frames(force.period_frames);
  return message;
}

/// nodes x 3 as 3 nodes.
Eigen::VectorXd decode_field(const proto::Array& array, const std::string& field, int nodes) {
  const Eigen::Matrix3Xd points = decode_points(array, field);
  if (nodes > 0 && points.cols() != nodes) {
    throw invalid(field + ".shape[0]",
                  fmt::format("{} nodes, the mesh has {}", points.cols(), nodes));
  }
  return points.reshaped();
}

scene::InitialState decode_initial(const proto::InitialState& message, const std::string& field,
                                   int nodes, Faults& faults) {
  scene::InitialState initial;
  if (message.has_displacements()) {
    faults.try_to([&] {
      initial.displacement = decode_field(message.displacements(), field + ".displacements", nodes);
    });
  }
  initial.modes.assign(message.modes().begin(), message.modes().end());
  if (message.has_velocities()) {
    faults.try_to([&] {
      initial.velocity = decode_field(message.velocities(), field + ".velocities", nodes);
    });
  }
  initial.common_velocity = decode_vector(message.velocity());
  return initial;
}

proto::InitialState encode_initial(const scene::InitialState& initial) {
  proto::InitialState message;
  if (initial.displacement.size() > 0)
    *message.mutable_displacements() =
        encode_points_float64(initial.displacement.reshaped(3, initial.displacement.size() / 3));
  message.mutable_modes()->Assign(initial.modes.begin(), initial.modes.end());
  if (initial.velocity.size() > 0)
    *message.mutable_velocities() =
        encode_points_float64(initial.velocity.reshaped(3, initial.velocity.size() / 3));
  encode_vector(initial.common_velocity, *message.mutable_velocity());
  return message;
}

}  // namespace

scene::Simulation decode_simulation(const proto::Simulation& message, const std::string& field,
                                    int nodes, Faults& faults) {
  scene::Simulation simulation;
  simulation.gravity = decode_vector(message.gravity());
  for (int i = 0; i < message.forces_size(); ++i) {
    simulation.forces.push_back(
        decode_force(message.forces(i), fmt::format("{}.forces[{}]", field, i), faults));
  }
  simulation.initial = decode_initial(message.initial(), field + ".initial", nodes, faults);
  if (message.has_frames_per_second()) simulation.frames_per_second = message.frames_per_second();
  if (message.has_steps_per_frame()) {
    faults.try_to([&] {
      simulation.steps_per_frame =
          decode_index(message.steps_per_frame(), field + ".steps_per_frame");
    });
  }
  simulation.scheme = kTimeSteppings.decode(message.scheme());
  simulation.mass_damping = message.mass_damping();
  simulation.relaxation_time = message.relaxation_time();
  return simulation;
}

proto::Simulation encode_simulation(const scene::Simulation& simulation) {
  proto::Simulation message;
  encode_vector(simulation.gravity, *message.mutable_gravity());
  for (const auto& force : simulation.forces) *message.add_forces() = encode_force(force);
  *message.mutable_initial() = encode_initial(simulation.initial);
  if (simulation.frames_per_second) message.set_frames_per_second(*simulation.frames_per_second);
  message.set_steps_per_frame(static_cast<std::uint32_t>(simulation.steps_per_frame));
  message.set_scheme(kTimeSteppings.encode(simulation.scheme));
  message.set_mass_damping(simulation.mass_damping);
  message.set_relaxation_time(simulation.relaxation_time);
  return message;
}

proto::SimulationReport encode_report(const session::SimulatedMotion& motion) {
  const session::SimulationReport& report = motion.report;
  proto::SimulationReport message;
  message.set_nodes(static_cast<std::uint32_t>(motion.positions.rows() / 3));
  message.set_frames(static_cast<std::uint32_t>(motion.positions.cols()));
  message.set_frames_per_second(report.frames_per_second);
  message.set_steps(static_cast<std::uint32_t>(report.steps));
  message.set_shortened_steps(static_cast<std::uint32_t>(report.shortened_steps));
  message.set_newton_steps(static_cast<std::uint32_t>(report.newton_steps));
  message.mutable_kinetic_energy()->Assign(report.kinetic.begin(), report.kinetic.end());
  message.mutable_elastic_energy()->Assign(report.elastic.begin(), report.elastic.end());
  message.mutable_work()->Assign(report.work.begin(), report.work.end());
  message.set_energy_drift(report.energy_drift);
  message.set_smallest_volume_ratio(report.smallest_volume_ratio);
  message.set_smallest_frame(static_cast<std::uint32_t>(report.smallest_frame));
  message.set_smallest_tet(static_cast<std::uint32_t>(report.smallest_tet));
  message.set_message(report.message);
  return message;
}

}  // namespace limber::server
