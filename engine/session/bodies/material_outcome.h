#pragma once

#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// Adds the outcome of the material's optimisation to a report: a motion that has converged for a
/// material that has not settled has not converged.
void report_outcome(const spacetime::MaterialReport& material, spacetime::SolveReport& report);

}  // namespace limber::session
