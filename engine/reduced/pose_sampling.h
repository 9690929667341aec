#pragma once

#include <Eigen/Core>

#include "engine/base/random.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced {

/// Which amplitudes a set of poses has, as factors of `amplitude`.
enum class PoseLevels {
  kTraining,  // three quarters uniform in [0.1, 1.25], the rest logarithmic from 0.003 to 0.3: the
              // linear regime counts
  kTest,      // uniform in [0.2, 1]
  kSmall,     // 0.01
};

/// Random poses z (R x count). Elastic coordinates are independent normal numbers (equal energies,
/// since modes are scaled by 1 / sqrt(lambda)). Half of the poses have a further random decay
/// towards high frequencies. Poses are then scaled so that the largest displacement of the linear
/// pose W-hat z is level times `amplitude` body lengths. A free body also turns, about a random
/// axis by up to level times 1.5 rad; it is not moved, since that is exact.
[[nodiscard]] Eigen::MatrixXd sample_poses(const ScaledModes& modes, double body_length,
                                           double amplitude, PoseLevels levels, int count,
                                           Random& random);

}  // namespace limber::reduced
