#pragma once

#include "engine/spacetime/recovery_energy.h"

namespace limber::spacetime {

/// Levenberg-Marquardt steps over z and S at once, with Lambda, D and the columns' scale fitted
/// exactly after each (see NOTATION.md).
class RecoveryStep {
 public:
  explicit RecoveryStep(const RecoveryEnergy& energy) : energy_(energy) {}

  /// Moves `at` where that lowers the energy, else leaves it.
  /// @returns the energy gained, >= 0
  double take(RecoveredMotion& at);

 private:
  struct Model;
  const RecoveryEnergy& energy_;
  double damping_ = 1e-3;
};

}  // namespace limber::spacetime
