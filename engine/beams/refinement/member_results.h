#pragma once

#include "engine/beams/refinement/subdivision.h"
#include "engine/beams/results/beam_results.h"

namespace limber::beams {

/// Results of a cut structure as those of the structure: moments are those at an element's ends,
/// axial force, torque and shears the means over its parts, stresses those of its part with the
/// largest equivalent one, energies sums.
/// @param results  of the cut structure
[[nodiscard]] BeamResults member_results(const BeamResults& results,
                                         const Subdivision& subdivision);

}  // namespace limber::beams
