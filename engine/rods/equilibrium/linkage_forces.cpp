#include "engine/rods/equilibrium/linkage_forces.h"

#include <algorithm>
#include <vector>

#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/linkage/linkage_assembly.h"

namespace limber::rods {

LinkageForces forces_in(const LinkageModel& model, const LinkageState& state,
                        const Conditions& conditions) {
  conditions.validate(model);
  LinkageAssembly assembly(model);
  detail::ConditionTerms terms(model, conditions);
  Eigen::VectorXd gradient(model.variables().size());
  (void)assembly.gradient(state, gradient);
  terms.add_gradient(state, gradient);

  LinkageForces forces;
  for (const detail::SpringPoint& spring : terms.springs())
    forces.springs.push_back({terms.place(state, spring), terms.pull(state, spring)});
  const int joints = model.variables().joints(), segments = model.variables().segments();
  for (Eigen::Matrix3Xd* of_joints : {&forces.loads, &forces.reaction_forces,
                                      &forces.reaction_moments, &forces.unbalanced_forces})
    of_joints->setZero(3, joints);
  for (int j = 0; j < joints; ++j) {
    const int begin = model.variables().joint_begin(j) + kJointPosition;
    forces.unbalanced_forces.col(j) = -gradient.segment<3>(begin);
  }
  for (const JointLoad& load : conditions.loads) forces.loads.col(load.joint) += load.force;
  for (const JointPin& pin : conditions.pins) {
    if (pin.hold == Hold::kAngle) continue;
    const int begin = model.variables().joint_begin(pin.joint);
    forces.reaction_forces.col(pin.joint) = gradient.segment<3>(begin + kJointPosition);
    forces.reaction_moments.col(pin.joint) = gradient.segment<3>(begin + kJointRotation);
    forces.unbalanced_forces.col(pin.joint).setZero();
  }
  if (conditions.mean_opening_angle) {
    std::vector<char> is_free(static_cast<std::size_t>(joints), 1);
    for (const JointPin& pin : conditions.pins)
      if (pin.hold != Hold::kMotion) is_free[static_cast<std::size_t>(pin.joint)] = 0;
    for (const AngleSetting& setting : conditions.angles)
      is_free[static_cast<std::size_t>(setting.joint)] = 0;
    for (int j = 0; j < joints; ++j) {
      if (is_free[static_cast<std::size_t>(j)] == 0) continue;
      forces.opening_moment += gradient[model.variables().joint_begin(j) + kJointAngle];
    }
    forces.opening_moment /=
        std::max<double>(1, static_cast<double>(std::count(is_free.begin(), is_free.end(), 1)));
  }
  forces.end_forces.setZero(3, 2 * segments);
  forces.end_moments.setZero(3, 2 * segments);
  forces.weights.setZero(3, segments);
  for (int s = 0; s < segments; ++s) {
    forces.weights.col(s) = terms.weight(s);
    for (const End end : {kStart, kFinish}) {
      if (model.graph().segments[static_cast<std::size_t>(s)].joints[end] < 0) continue;
      const Eigen::Matrix<double, kJointUnknowns, 1> own =
          assembly.end_gradient(state, s, end) + terms.end_gradient(state, s, end);
      forces.end_forces.col(2 * s + end) = -own.segment<3>(kJointPosition);
      forces.end_moments.col(2 * s + end) = -own.segment<3>(kJointRotation);
    }
  }
  return forces;
}

}  // namespace limber::rods
