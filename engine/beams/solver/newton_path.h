#pragma once

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/solver/load_path.h"

namespace limber::beams::detail {

/// Load steps by Newton's method from s to 1; steps are halved where they fail and grow where they
/// are easy. Changes state and report.
void follow_path(const BeamStructure& structure, const LoadPath& path, double s,
                 const BeamSolveOptions& options, const JobContext& context,
                 const BeamObserver& observer, BeamState& state, BeamReport& report);

/// Is a balanced state a minimum? Changes the status of a report that says converged where it is a
/// saddle (kUnstable) or something moves without resistance (kMechanism). Following loads have no
/// potential: where the energy falls, divergence is what counts, and the message says that it is
/// all that is judged.
void certify(const BeamStructure& structure, const JobContext& context, const NodeLoads& loads,
             const BeamState& state, BeamReport& report);

}  // namespace limber::beams::detail
