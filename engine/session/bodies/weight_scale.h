#pragma once

#include "engine/scene/scene.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// Weights that meet Scene::constraint_tolerance. The error of a constraint is its multiplier over
/// its weight, so ten times the weight gives about a tenth of the error. Therefore only powers of
/// ten are tried, and one that leaves a twentieth of the tolerance is one too many.
inline constexpr double kGreatestWeightScale = 1e6;

/// @param missed  largest error of a constraint [scene length unit]
/// @param raised  whether a smaller scale has been left since the last edit: then it is not tried
/// again. Is updated.
[[nodiscard]] double next_weight_scale(double scale, double missed, double tolerance, bool& raised);

/// Says so where the tolerance is not met.
void report_missed_tolerance(const scene::Scene& scene, double scale,
                             spacetime::SolveReport& report);

}  // namespace limber::session
