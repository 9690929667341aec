#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/recovery.h"

namespace limber::spacetime {

/// The free motion that is nearest to the recorded motion of one mode.
///
/// Fitted to displacements of all frames and not to forces: those of fit_mode() are differences of
/// neighbouring frames, which other frequencies in the motion bias. A body that moves far forces
/// its modes with sums and differences of their frequencies; they are fitted together with the
/// swing and left out of it. Poles by the method of Roy and Kailath, "ESPRIT - estimation of signal
/// parameters via rotational invariance techniques", IEEE Trans. ASSP 37 (1989), of up to four
/// swings; the largest is the mode's.
struct ModeSwing {
  ModeFit dynamics;      // of the swing; those given where no swing explains half of the motion
  Eigen::RowVectorXd z;  // free motion with these dynamics, of the last swing at least
  double residual = 0;   // |motion - nearest free motion| / |motion|
  double several_residual = 0;  // the same of the best of several swings together, <= residual
};

/// @param motion  of one mode, one number a frame, where no known force acts
/// @param given  the dynamics that need least force for it
[[nodiscard]] ModeSwing fit_swing(const Eigen::RowVectorXd& motion, const ModeFit& given,
                                  Discretisation discretisation = Discretisation::kDifferences);

/// fit_swing() of each mode.
/// @param driven  frames at the beginning that do not count
[[nodiscard]] std::vector<ModeSwing> fit_swings(const RecoveredMotion& motion, Eigen::Index driven);

/// @returns `motion` with the dynamics of the swings, and with their z in frames that are not
/// driven
[[nodiscard]] RecoveredMotion swinging(const RecoveredMotion& motion,
                                       const std::vector<ModeSwing>& swings);

/// The part of S z that free motion of each mode does not explain, as if modes were orthogonal.
/// @param eigenvalues  R: displacements by coordinate k go with eigenvalue_k^(-1/2)
/// (reduced::ScaledModes)
/// @returns the share of displacements
[[nodiscard]] double share_not_free(const RecoveredMotion& motion,
                                    const std::vector<ModeSwing>& swings,
                                    const Eigen::VectorXd& eigenvalues);

/// The modes that several frequencies explain and a single one does not, of those that move the
/// body visibly. Empty: there are none.
[[nodiscard]] std::string describe_several_frequencies(const RecoveredMotion& motion,
                                                       const std::vector<ModeSwing>& swings,
                                                       const Eigen::VectorXd& eigenvalues);

}  // namespace limber::spacetime
