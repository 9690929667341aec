#pragma once

#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// What is to be said of an answer whose material was optimised: a motion that has converged for a
/// material that has not settled has not converged.
void tell_outcome(const spacetime::MaterialReport& material, spacetime::SolveReport& report);

}  // namespace limber::session
