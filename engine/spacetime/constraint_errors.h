#pragma once

#include <algorithm>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// How far a constraint on a position is missed, over its axes.
struct ConstraintMiss {
  ConstraintId id = 0;
  double distance = 0;  // [m]
  bool is_exact = false;
};

/// Errors of a motion in its constraints, over the axes of each constraint.
struct ConstraintErrors {
  double max_constraint_error = 0;      // over all constraints on positions, distance [m]
  double rms_constraint_error = 0;      // over these constraints [m]
  double max_exact_error = 0;           // over exact ones of them only [m]
  double max_velocity_error = 0;        // over all constraints on velocities, difference [m/frame]
  double max_exact_velocity_error = 0;  // over exact ones of them only [m/frame]
  double max_keyframe_error = 0;        // over keyframes, |S z - z-bar| (unitless)

  /// Largest error of exact constraints on positions and velocities [m]. The error of a velocity
  /// counts as the distance that it makes in one frame.
  [[nodiscard]] double exact_error() const {
    return std::max(max_exact_error, max_exact_velocity_error);
  }
};

}  // namespace limber::spacetime
