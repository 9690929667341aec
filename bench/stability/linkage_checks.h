#pragma once

#include "bench/stability/sweep.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::bench::stability {

/// Claim of a report; error and limit are for the caller.
[[nodiscard]] Finding finding_of(const rods::EquilibriumReport& report,
                                 const rods::LinkageModel& model, const rods::LinkageState& state);

/// Distance of a shape from a minimum of its potential, by differences of that alone, dense:
/// sqrt(gain of a step of Newton's method over the elastic energy). It is 1 if the potential falls
/// in some direction. Loads without moments, springs at joints.
/// @param mean_moment  EquilibriumReport::mean_angle_moment
/// @param elastic  the unit of gains [energy], > 0
[[nodiscard]] double minimum_error(const rods::LinkageModel& model, const rods::LinkageState& state,
                                   const rods::Conditions& conditions, double mean_moment,
                                   double elastic);

}  // namespace limber::bench::stability
