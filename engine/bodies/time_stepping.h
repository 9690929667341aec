#pragma once

namespace limber::bodies {

enum class TimeStepping {
  /// Backward Euler: loses energy with every step, more the faster the motion; never gains any.
  kImplicitEuler,
  /// Implicit midpoint rule: of second order, symplectic; keeps linear and angular momentum to the
  /// tolerance and energy within a band that narrows with the square of the step.
  kImplicitMidpoint,
};

}  // namespace limber::bodies
