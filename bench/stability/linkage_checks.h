#pragma once

#include "bench/stability/sweep.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::bench::stability {

/// What a report says of itself; error and limit are for the caller.
[[nodiscard]] Finding finding_of(const rods::EquilibriumReport& report,
                                 const rods::LinkageModel& model, const rods::LinkageState& state);

/// How far a shape is from a minimum of its potential, by differences of that alone, dense:
/// sqrt(what a step of Newton's method would gain over the elastic energy), and 1 where the
/// potential falls in some direction. Loads without moments, springs at joints.
/// @param mean_moment  EquilibriumReport::mean_angle_moment
/// @param elastic      what gains are measured by [energy], > 0
[[nodiscard]] double minimum_error(const rods::LinkageModel& model, const rods::LinkageState& state,
                                   const rods::Conditions& conditions, double mean_moment,
                                   double elastic);

}  // namespace limber::bench::stability
