#include "engine/beams/structure/node_loads.h"

#include "engine/base/index.h"

namespace limber::beams {

namespace {

NodeLoads none(const BeamModel& model) {
  const auto n = static_cast<Eigen::Index>(model.nodes.size());
  const Eigen::Matrix3Xd zero = Eigen::Matrix3Xd::Zero(3, n);
  return {zero, zero, zero, zero};
}

void add(const std::vector<NodalLoad>& loads, NodeLoads& sum) {
  for (const NodalLoad& load : loads) {
    const bool follows = load.direction == LoadDirection::kFollowing;
    (follows ? sum.following_forces : sum.forces).col(load.node) += load.force;
    (follows ? sum.following_moments : sum.moments).col(load.node) += load.moment;
  }
}

}  // namespace

NodeLoads NodeLoads::of(const BeamModel& model) {
  NodeLoads sum = none(model);
  add(model.loads, sum);
  const auto length = [&model](int e) {
    const BeamElement& element = model.elements[index(e)];
    return element.rest_length > 0 ? element.rest_length : drawn_length(model, e);
  };
  for (const DistributedLoad& load : model.distributed_loads) {
    const BeamElement& e = model.elements[index(load.element)];
    auto& forces = load.direction == LoadDirection::kFollowing ? sum.following_forces : sum.forces;
    const Eigen::Vector3d half = 0.5 * length(load.element) * load.force;
    forces.col(e.start) += half;
    forces.col(e.finish) += half;
  }
  if (model.gravity.isZero(0)) return sum;
  for (int i = 0; i < static_cast<int>(model.elements.size()); ++i) {
    const BeamElement& e = model.elements[index(i)];
    const double mass = model.sections[index(e.section)].mass_per_length * length(i);
    sum.forces.col(e.start) += 0.5 * mass * model.gravity;
    sum.forces.col(e.finish) += 0.5 * mass * model.gravity;
  }
  return sum;
}

NodeLoads NodeLoads::temporary(const BeamModel& model) {
  NodeLoads sum = none(model);
  add(model.temporary_loads, sum);
  return sum;
}

bool NodeLoads::empty() const { return forces.isZero(0) && moments.isZero(0) && !follows(); }

bool NodeLoads::follows() const {
  return !following_forces.isZero(0) || !following_moments.isZero(0);
}

NodeLoads NodeLoads::operator*(double factor) const {
  return {forces * factor, moments * factor, following_forces * factor, following_moments * factor};
}

NodeLoads NodeLoads::operator+(const NodeLoads& other) const {
  return {forces + other.forces, moments + other.moments, following_forces + other.following_forces,
          following_moments + other.following_moments};
}

Eigen::VectorXd load_vector(const BeamStructure& structure, const NodeLoads& loads,
                            const BeamState& state) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(structure.unknowns());
  const bool follows = loads.follows();
  for (int i = 0; i < structure.nodes(); ++i) {
    Eigen::Vector3d force = loads.forces.col(i), moment = loads.moments.col(i);
    if (follows) {
      const Eigen::Matrix3d turn = state.rotations[index(i)].toRotationMatrix();
      force += turn * loads.following_forces.col(i);
      moment += turn * loads.following_moments.col(i);
    }
    const Eigen::Matrix3d& axes = structure.node_axes(i);
    result.segment<3>(6 * i) = axes.transpose() * force;
    result.segment<3>(6 * i + 3) = axes.transpose() * moment;
  }
  return result;
}

}  // namespace limber::beams
