#pragma once

#include "engine/spacetime/recovery_energy.h"

namespace limber::spacetime {

/// Levenberg-Marquardt steps over z and S at once, with Lambda, D and the columns' scale fitted
/// exactly after each (see NOTATION.md). More than 32 modes: z and S in turns, since the coupling
/// of r modes is a dense r^2 x r^2 system.
class RecoveryStep {
 public:
  explicit RecoveryStep(const RecoveryEnergy& energy) : energy_(energy) {}

  /// Moves `at` where that lowers the energy, else leaves it.
  /// @returns the energy gained, >= 0
  /// @throws Error{kCancelled}, asked several times a step
  double take(RecoveredMotion& at, const JobContext& job = {});

 private:
  struct Model;
  const RecoveryEnergy& energy_;
  double damping_ = 1e-3;
};

}  // namespace limber::spacetime
