#pragma once

#include <string>
#include <vector>

#include "engine/spacetime/solver.h"

namespace limber::session {

/// Targets of soft constraints that are nearer to rest are a matter of weights; bodies meet those
/// beyond only inside out, if at all [body lengths].
inline constexpr double kFarTarget = 2;

/// Constraints that an optimum does not reach because the body cannot get there. These are exact
/// ones that are missed without contradicting others. They are also soft ones that are missed by
/// more than half the body's length although their targets are more than two lengths from rest.
/// Soft targets that are nearer are a matter of weights. If a solve ended before its optimum, only
/// targets beyond two lengths count, and none after a cancellation.
/// @param constraints  that were solved for
/// @param length  of the body [m]
[[nodiscard]] std::vector<spacetime::ConstraintMiss> out_of_reach(
    const spacetime::SolveReport& report,
    const std::vector<spacetime::PositionConstraint>& constraints, double length);

/// Names the worst of them with the distance that is left, and what to do; empty where there is
/// none.
/// @param length_unit  of the scene [m]: distances are in it
[[nodiscard]] std::string describe_reach(
    const std::vector<spacetime::ConstraintMiss>& missed,
    const std::vector<spacetime::PositionConstraint>& constraints, double length,
    double length_unit);

}  // namespace limber::session
