#pragma once

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/solver/load_path.h"

namespace limber::beams::detail {

/// Load steps by Newton's method from s to 1; steps are halved where they fail and grow where they
/// are easy. Changes state and report; where the branch is watched and s < 1, that has an
/// equilibrium_share.
void follow_path(const BeamStructure& structure, const LoadPath& path, double s,
                 const BeamSolveOptions& options, const JobContext& context,
                 const BeamObserver& observer, BeamState& state, BeamReport& report);

}  // namespace limber::beams::detail
