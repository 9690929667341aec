#include "engine/beams/structure/node_loads.h"

#include "engine/base/index.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/beams/structure/element_unknowns.h"

namespace limber::beams {

namespace {

void add(const std::vector<NodalLoad>& loads, NodeLoads& sum) {
  for (const NodalLoad& load : loads) {
    const bool follows = load.direction == LoadDirection::kFollowing;
    (follows ? sum.following_forces : sum.forces).col(load.node) += load.force;
    (follows ? sum.following_moments : sum.moments).col(load.node) += load.moment;
  }
}

/// If an end does not pass a force on, the other one carries it; if both do not, neither does.
Carrier carrier_of(const BeamElement& element, std::size_t axis) {
  const bool start = element.start_release.forces[axis];
  if (start == element.finish_release.forces[axis]) return Carrier::kBoth;
  return start ? Carrier::kFinish : Carrier::kStart;
}

}  // namespace

NodeLoads NodeLoads::none(const BeamModel& model) {
  const Eigen::Matrix3Xd nodes =
      Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(model.nodes.size()));
  const Eigen::Matrix3Xd elements =
      Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(model.elements.size()));
  return {nodes, nodes, nodes, nodes, elements, elements};
}

NodeLoads NodeLoads::of(const BeamModel& model) {
  NodeLoads sum = none(model);
  add(model.loads, sum);
  const auto length = [&model](int e) {
    const BeamElement& element = model.elements[index(e)];
    return element.rest_length > 0 ? element.rest_length : drawn_length(model, e);
  };
  for (const DistributedLoad& load : model.distributed_loads) {
    auto& forces = load.direction == LoadDirection::kFollowing ? sum.following_element_forces
                                                               : sum.element_forces;
    forces.col(load.element) += length(load.element) * load.force;
  }
  if (model.gravity.isZero(0)) return sum;
  for (int i = 0; i < static_cast<int>(model.elements.size()); ++i) {
    const BeamElement& e = model.elements[index(i)];
    const double mass = model.sections[index(e.section)].mass_per_length * length(i);
    sum.element_forces.col(i) += mass * model.gravity;
  }
  return sum;
}

NodeLoads NodeLoads::temporary(const BeamModel& model) {
  NodeLoads sum = none(model);
  add(model.temporary_loads, sum);
  return sum;
}

bool NodeLoads::empty() const {
  return forces.isZero(0) && moments.isZero(0) && element_forces.isZero(0) && !follows();
}

bool NodeLoads::follows() const {
  return !following_forces.isZero(0) || !following_moments.isZero(0) ||
         !following_element_forces.isZero(0);
}

bool NodeLoads::loads_elements() const {
  return !element_forces.isZero(0) || !following_element_forces.isZero(0);
}

NodeLoads NodeLoads::operator*(double factor) const {
  return {forces * factor,           moments * factor,
          following_forces * factor, following_moments * factor,
          element_forces * factor,   following_element_forces * factor};
}

NodeLoads NodeLoads::operator+(const NodeLoads& other) const {
  return {forces + other.forces,
          moments + other.moments,
          following_forces + other.following_forces,
          following_moments + other.following_moments,
          element_forces + other.element_forces,
          following_element_forces + other.following_element_forces};
}

LoadTransfer load_transfer(const BeamStructure& structure, int element) {
  const BeamElement& e = structure.model().elements[index(element)];
  LoadTransfer transfer;
  if (e.kind == BeamKind::kCable) return transfer;
  transfer.lever = structure.constants(element).length;
  for (std::size_t axis = 0; axis < 3; ++axis) transfer.carriers[axis] = carrier_of(e, axis);
  return transfer;
}

SpreadLoad following_load(const BeamStructure& structure, const NodeLoads& loads,
                          const ElementEnds& ends, int element) {
  const Eigen::Vector3d force = loads.following_element_forces.col(element);
  if (force.isZero(0)) return {};
  const Eigen::Matrix3d& rest = structure.rest_axes(element);
  if (structure.model().elements[index(element)].kind == BeamKind::kCable) {
    const Eigen::Vector3d turned =
        rotations::shortest_rotation(rest.col(0), ends.finish - ends.start) * force;
    return {turned, turned};
  }
  const Eigen::Vector3d by_axes = rest.transpose() * force;
  return {ends.start_axes * by_axes, ends.finish_axes * by_axes};
}

SpreadLoad load_over(const BeamStructure& structure, const NodeLoads& loads,
                     const ElementEnds& ends, int element) {
  SpreadLoad load = following_load(structure, loads, ends, element);
  load.start += loads.element_forces.col(element);
  load.finish += loads.element_forces.col(element);
  return load;
}

Eigen::VectorXd load_vector(const BeamStructure& structure, const NodeLoads& loads,
                            const BeamState& state) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(structure.unknowns());
  const bool follows = !loads.following_forces.isZero(0) || !loads.following_moments.isZero(0);
  for (int i = 0; i < structure.nodes(); ++i) {
    Eigen::Vector3d force = loads.forces.col(i), moment = loads.moments.col(i);
    if (follows) {
      const Eigen::Matrix3d turn = state.rotations[index(i)].toRotationMatrix();
      force += turn * loads.following_forces.col(i);
      moment += turn * loads.following_moments.col(i);
    }
    result.segment<3>(6 * i) = structure.node_axes(i).transpose() * force;
    result.segment<3>(6 * i + 3) =
        structure.spin_axes(i, state.rotations[index(i)]).transpose() * moment;
  }
  if (!loads.loads_elements()) return result;
  for (int e = 0; e < structure.elements(); ++e) {
    if (loads.element_forces.col(e).isZero(0) && loads.following_element_forces.col(e).isZero(0))
      continue;
    const ElementEnds ends = structure.ends(state, e);
    const ElementVector forces =
        spread_forces(load_transfer(structure, e), ends, load_over(structure, loads, ends, e));
    add_to_unknowns(structure, state, e, forces, result);
  }
  return result;
}

}  // namespace limber::beams
