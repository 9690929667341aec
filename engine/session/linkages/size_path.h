#pragma once

#include <functional>

#include "engine/base/job.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/session/linkages/rod_sizes.h"

namespace limber::session {

/// Leads a shape to other sizes of its rods, under unchanged conditions. Each step makes them a
/// little longer or shorter, thicker or thinner, and is solved no more exactly than the path needs.
/// @param model  the equilibrium's; keeps the sizes of the last step
/// @param sizes  what the model has; the last step's then
/// @param state  an equilibrium of these, at least nearly; the last step's then
/// @param on_step  may be empty
/// @returns the report of the last solve; where it is not converged, the path ends there. Converged
/// where the sizes are those there are already
[[nodiscard]] rods::EquilibriumReport follow_sizes(rods::LinkageModel& model, RodSizes& sizes,
                                                   rods::LinkageEquilibrium& equilibrium,
                                                   rods::LinkageState& state,
                                                   const rods::Conditions& held,
                                                   const RodSizes& target, const JobContext& job,
                                                   const std::function<void()>& on_step);

}  // namespace limber::session
