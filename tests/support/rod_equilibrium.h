#pragma once

#include <vector>

#include "engine/rods/rod/rod_state.h"

namespace limber::rods {

/// Dead loads, per slot of the layout. Empty members: none.
struct RodLoads {
  Eigen::Matrix3Xd forces;  // on nodes [force]
  Eigen::VectorXd torques;  // on the angles theta of edges [force length]
  /// On edges, in fixed directions [force length]. A moment that does not keep to one axis has no
  /// potential; equilibria are found all the same, with a symmetrised stiffness.
  Eigen::Matrix3Xd moments;
};

/// What to do where forces balance but the energy decreases in some direction (a straight rod under
/// more than its critical load). With dead moments, which need not have an energy, it is kStop.
enum class AtSaddle { kStop, kLeave };

struct RodEquilibriumOptions {
  int max_iterations = 400;  // > 0
  /// Unbalanced force at a node over the largest force in an edge, and unbalanced torque over the
  /// largest moment; rounding of stretching is allowed for on top. In (0, 1).
  double tolerance = 1e-9;
  double largest_turn = 0.7;  // of an edge in one step [rad], in (0, 1.5]
  AtSaddle at_saddle = AtSaddle::kLeave;
  /// @throws Error{kInvalidArgument}
  void validate() const;
};

enum class RodStatus {
  kConverged,
  kIterationLimit,
  kStalled,  // no step, however small, lowered the energy
};

struct RodReport {
  RodStatus status = RodStatus::kIterationLimit;
  int iterations = 0;
  int factorizations = 0;
  int saddles_left = 0;
  double residual = 0;  // the larger of the two ratios of RodEquilibriumOptions::tolerance
  RodEnergies energies;
  /// Whether the last Hessian was positive definite: a minimum, not a saddle.
  bool stable = false;
};

struct RodEquilibrium {
  RodAtSource at;
  RodReport report;
};

/// Static equilibrium near a start by Newton's method: band Cholesky of the Hessian, shifted where
/// it is not positive definite; steps turn edges along circles instead of along chords, so that
/// nearly inextensible rods may bend far in one step; backtracking on the energy.
/// @param fixed  one per unknown of the layout, nonzero where it keeps its value of `start`
/// @throws Error{kInvalidArgument} for sizes and options, Error{kFailedPrecondition} if `start` is
/// not finite
[[nodiscard]] RodEquilibrium find_equilibrium(const RodState& start,
                                              const RodParameters& parameters,
                                              const RodLoads& loads, const std::vector<char>& fixed,
                                              const RodEquilibriumOptions& options = {});

}  // namespace limber::rods
