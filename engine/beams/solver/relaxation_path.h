#pragma once

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/solver/load_path.h"

namespace limber::beams::detail {

/// Dynamic relaxation along a load path: temporary loads alone, then everything over the ramp, then
/// until forces and moments balance to `tolerance`. Changes state and report; kConverged says
/// balance only, not that it is a minimum.
void relax(const BeamStructure& structure, const LoadPath& path, double tolerance,
           const BeamSolveOptions& options, const JobContext& context, const BeamObserver& observer,
           BeamState& state, BeamReport& report);

}  // namespace limber::beams::detail
