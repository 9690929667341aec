#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "engine/spacetime/force_rows.h"

namespace limber::spacetime {

/// Stiffness and damping of one mode, as in ModeDynamics.
struct ModeFit {
  double stiffness = 0;  // lambda [1/frame^2], >= 0
  double damping = 0;    // d [1/frame], >= 0
};

/// The dynamics that need least force for a given motion of one mode. Minimises
///   sum_i (z_(i+1) - 2 z_i + z_(i-1) + d (z_(i+1) - z_i) + lambda z_i)^2
/// over 0 <= lambda <= max_stiffness and d >= 0 (paper: space-time editing, eq. 17a), jointly and
/// exactly. The paper solves for one after the other and clips (section 5.4), which is not the
/// minimum.
///
/// The answer is unique even if the motion does not determine both. A number without effect is 0:
/// both for z = 0, for a constant z and for fewer than three frames. If velocity and displacement
/// are proportional (z geometric), one of the two is 0: damping, if either is possible. The scale
/// of z has no effect.
/// @param z              N, one number a frame
/// @param max_stiffness  [1/frame^2], >= 0
/// @throws Error{kInvalidArgument} naming z for numbers that are not finite
[[nodiscard]] ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z,
                               double max_stiffness = std::numeric_limits<double>::infinity());

/// The dynamics that a fit chooses from.
struct FitOptions {
  Discretisation discretisation = Discretisation::kDifferences;
  double smoothing = 0;                                            // tau [frames], >= 0
  double max_stiffness = std::numeric_limits<double>::infinity();  // [1/frame^2], >= 0
  /// For a sampled mode: one more start, so that the result is no worse than it. It has no effect
  /// on the published form, whose fit is exact.
  std::optional<ModeFit> known = std::nullopt;
  Beginning beginning = Beginning::kFromRest;

  /// Bounds of zeta = d / (2 sqrt(lambda)) of sampled modes. Bodies lose more than the lower one;
  /// above the upper one a motion of some seconds does not tell how much.
  static constexpr double kLeastDampingRatio = 1e-4, kGreatestDampingRatio = 2;
  /// For a sampled mode [1/frame^2]: the stiffness at the Nyquist frequency, pi^2. Faster swings
  /// look like slower ones.
  static constexpr double kGreatestSampledStiffness = 9.869604401089358;
};

/// The same for the forces of these options (ForceRows).
///
/// Sampled modes: minimises over omega and zeta, lambda = omega^2 and d = 2 zeta omega, in their
/// bounds. Forces are not linear in them, so there may be several minima. The result is the lowest
/// one reached from three starts: the best of a grid, `known`, and the linear prediction. The
/// latter predicts each frame from the two before it and is exact for free motion. If omega is 0, d
/// is 0.
/// @throws Error{kInvalidArgument} as above
[[nodiscard]] ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z,
                               const FitOptions& options);

/// The nearest dynamics within the bounds: stiffness is lowered, and the damping ratio of sampled
/// modes kept where it is within its own bounds.
[[nodiscard]] ModeFit bounded_fit(const ModeFit& fit, const FitOptions& options);

}  // namespace limber::spacetime
