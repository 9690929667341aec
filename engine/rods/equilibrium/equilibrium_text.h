#pragma once

#include <string>

#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

// Messages on equilibria that were not found: cause, place, size, and remedy.
namespace limber::rods::detail {

/// For equilibria that are no minima.
inline constexpr const char* kSlowMotionsOnly =
    "moments of fixed direction have no potential: the shape returns from slow motions, whether "
    "masses make it flutter is not judged";

/// "joint 7", or "segment 3".
[[nodiscard]] std::string place_of(const ReducedVariables& variables, int unknown);

/// Text such as "the force at joint 7 is out of balance by 3.2 N, 9.6 % of the largest (limit 1e-06
/// %)". For moments it omits the size, whose unit is not known here.
/// @param gradient  without the reactions of the constraints
[[nodiscard]] std::string imbalance_text(const ReducedVariables& variables,
                                         const UnknownScales& scales,
                                         const Eigen::VectorXd& gradient,
                                         const GradientSize& present, double tolerance,
                                         double beyond);

/// For a shape whose energy is not finite: the segment where an edge has no length or folds back.
[[nodiscard]] std::string degenerate_text(const LinkageModel& model, const LinkageState& state);

}  // namespace limber::rods::detail
