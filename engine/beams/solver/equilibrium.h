#pragma once

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// The equilibrium of a structure under its loads, supports and motions, from the state as drawn.
///
/// Stops with BeamStatus::kCancelled and the state at hand where the job is cancelled.
/// @param observer  called from the working thread with states on the way; may be empty
/// @throws Error as BeamSolveOptions::validate
[[nodiscard]] BeamSolution find_equilibrium(const BeamStructure& structure,
                                            const BeamSolveOptions& options = {},
                                            const JobContext& context = {},
                                            const BeamObserver& observer = {});

/// The same from a given state of the same structure (its unknowns as they are, held ones brought
/// to where motions want them): for models whose loads or supports have changed a little.
[[nodiscard]] BeamSolution find_equilibrium_from(const BeamStructure& structure,
                                                 const BeamState& start,
                                                 const BeamSolveOptions& options = {},
                                                 const JobContext& context = {},
                                                 const BeamObserver& observer = {});

}  // namespace limber::beams
