// Structures of beams as messages.
#include "server/kinds/beams/structure.h"

namespace limber::server {
namespace {

void set_vector(const Eigen::Vector3d& vector, proto::Vector3& message) {
  message.set_x(vector.x());
  message.set_y(vector.y());
  message.set_z(vector.z());
}

void encode_release(const beams::EndRelease& release, proto::BeamRelease& message) {
  for (std::uint32_t axis = 1; axis <= 3; ++axis) {
    if (release.forces[axis - 1]) message.add_forces(axis);
    if (release.rotations[axis - 1]) message.add_rotations(axis);
  }
}

void encode_element(const beams::BeamElement& element, proto::BeamElement& message) {
  message.set_start(static_cast<std::uint32_t>(element.start));
  message.set_finish(static_cast<std::uint32_t>(element.finish));
  message.set_section(static_cast<std::uint32_t>(element.section));
  if (element.kind == beams::BeamKind::kCable) message.set_kind(proto::BEAM_KIND_CABLE);
  if (!element.normal.isZero(0)) set_vector(element.normal, *message.mutable_normal());
  message.set_rest_length(element.rest_length);
  if (!element.rest_curvature.isZero(0))
    set_vector(element.rest_curvature, *message.mutable_rest_curvature());
  const beams::EndRelease none;
  if (element.start_release != none)
    encode_release(element.start_release, *message.mutable_start_release());
  if (element.finish_release != none)
    encode_release(element.finish_release, *message.mutable_finish_release());
}

/// Of a BeamSupport or BeamMotion.
template <class Message>
void encode_own_axes(const Eigen::Matrix3d& axes, Message& message) {
  if (axes.isIdentity(0)) return;
  set_vector(axes.col(0), *message.mutable_x_axis());
  set_vector(axes.col(1), *message.mutable_y_axis());
}

void encode_support(const beams::BeamSupport& support, proto::BeamSupport& message) {
  message.set_node(static_cast<std::uint32_t>(support.node));
  message.set_fix_x(support.fixed[0]);
  message.set_fix_y(support.fixed[1]);
  message.set_fix_z(support.fixed[2]);
  message.set_fix_rotation_x(support.fixed[3]);
  message.set_fix_rotation_y(support.fixed[4]);
  message.set_fix_rotation_z(support.fixed[5]);
  encode_own_axes(support.axes, message);
}

void encode_node_load(const beams::NodalLoad& load, proto::BeamLoad& message) {
  message.set_node(static_cast<std::uint32_t>(load.node));
  set_vector(load.force, *message.mutable_force());
  set_vector(load.moment, *message.mutable_moment());
  message.set_follows(load.direction == beams::LoadDirection::kFollowing);
}

void encode_distributed(const beams::DistributedLoad& load, proto::BeamDistributedLoad& message) {
  message.set_element(static_cast<std::uint32_t>(load.element));
  set_vector(load.force, *message.mutable_force());
  message.set_follows(load.direction == beams::LoadDirection::kFollowing);
}

}  // namespace

void encode_beam_motion(const beams::PrescribedMotion& motion, proto::BeamMotion& message) {
  message.set_node(static_cast<std::uint32_t>(motion.node));
  if (motion.translates[0]) message.set_x(motion.translation.x());
  if (motion.translates[1]) message.set_y(motion.translation.y());
  if (motion.translates[2]) message.set_z(motion.translation.z());
  if (motion.rotates_all()) {
    set_vector(motion.rotation, *message.mutable_rotation());
  } else {
    if (motion.rotates[0]) message.set_rotation_x(motion.rotation.x());
    if (motion.rotates[1]) message.set_rotation_y(motion.rotation.y());
    if (motion.rotates[2]) message.set_rotation_z(motion.rotation.z());
  }
  encode_own_axes(motion.axes, message);
}

proto::BeamStructure encode_beam_conditions(const session::BeamConditions& conditions) {
  proto::BeamStructure message;
  for (const auto& support : conditions.supports) encode_support(support, *message.add_supports());
  for (const auto& motion : conditions.motions) encode_beam_motion(motion, *message.add_motions());
  for (const auto& load : conditions.loads) encode_node_load(load, *message.add_loads());
  for (const auto& load : conditions.distributed_loads)
    encode_distributed(load, *message.add_distributed_loads());
  if (!conditions.gravity.isZero(0)) set_vector(conditions.gravity, *message.mutable_gravity());
  for (const auto& load : conditions.temporary_loads)
    encode_node_load(load, *message.add_temporary_loads());
  return message;
}

proto::BeamStructure encode_beam_structure(const DecodedBeams& structure) {
  const beams::BeamModel& model = structure.model;
  session::BeamConditions conditions = session::conditions_of(model);
  conditions.temporary_loads = model.temporary_loads;
  proto::BeamStructure message = encode_beam_conditions(conditions);
  message.set_name(structure.name);
  for (const auto& node : model.nodes) {
    auto& node_message = *message.add_nodes();
    set_vector(node.position, *node_message.mutable_position());
    set_vector(node.normal, *node_message.mutable_normal());
  }
  for (const auto& section : structure.sections) *message.add_sections() = section;
  for (const auto& element : model.elements) encode_element(element, *message.add_elements());
  return message;
}

}  // namespace limber::server
