#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Forces in an equilibrium, in the units of the model: the derivatives that its solver balances.
struct LinkageForces {
  struct Spring {
    Eigen::Vector3d point, force;  // point of action, and force on the linkage
  };
  std::vector<Spring> springs;  // as the conditions list them
  // Columns are joints; moments are about the joint.
  Eigen::Matrix3Xd loads;              // forces of the conditions
  Eigen::Matrix3Xd reaction_forces;    // of pins that hold the motion of a joint, else 0
  Eigen::Matrix3Xd reaction_moments;   // of the same
  Eigen::Matrix3Xd unbalanced_forces;  // at joints whose motion is free: within tolerance
  // Columns are 2 segment + end: action of the segment, with its weight and springs, on the joint
  // at its end; 0 at free ends.
  Eigen::Matrix3Xd end_forces, end_moments;
  Eigen::Matrix3Xd weights;  // of segments
  /// Moment on every joint that holds the mean opening angle, > 0 opens [force length]; 0 if none
  /// is prescribed.
  double opening_moment = 0;
};

/// @param conditions  that the state is in equilibrium under
/// @throws Error as Conditions::validate
[[nodiscard]] LinkageForces forces_in(const LinkageModel& model, const LinkageState& state,
                                      const Conditions& conditions);

}  // namespace limber::rods
