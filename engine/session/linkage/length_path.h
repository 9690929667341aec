#pragma once

#include <Eigen/Core>
#include <functional>

#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::session {

/// Leads a shape to other rest lengths, held as it is: each step a little longer or shorter, solved
/// no more exactly than the way there needs.
/// @param model  the equilibrium's; keeps the lengths of the last step
/// @param state  an equilibrium of its present lengths, at least nearly; the last step's then
/// @param on_step  may be empty
/// @returns the report of the last solve; where it is not converged, the way ends there. Converged
/// where the lengths are those there are already
[[nodiscard]] rods::EquilibriumReport follow_lengths(
    rods::LinkageModel& model, rods::LinkageEquilibrium& equilibrium, rods::LinkageState& state,
    const rods::Conditions& held, const Eigen::VectorXd& lengths, const JobContext& job,
    const std::function<void()>& on_step);

}  // namespace limber::session
