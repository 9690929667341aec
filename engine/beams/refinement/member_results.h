#pragma once

#include "engine/beams/results/beam_results.h"
#include "engine/beams/structure/subdivision.h"

namespace limber::beams {

/// Results of a cut structure as those of the structure. Extremes and stresses are those of the
/// part that has them, with their places along the element; moments are at its ends, energies are
/// sums.
/// @param results  of the cut structure
[[nodiscard]] BeamResults member_results(const BeamResults& results,
                                         const Subdivision& subdivision);

}  // namespace limber::beams
