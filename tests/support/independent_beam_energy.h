#pragma once

#include "engine/beams/structure/beam_structure.h"

// Stability of beams from outside: the energy of the element (NOTATION.md), written down anew with
// rotation vectors and in long double. It shares no code and no derivative with the engine. Nothing
// is released, nothing is a cable, and sections are straight at rest.

namespace limber::testing {

/// Of one element in a state [force length].
[[nodiscard]] long double independent_energy(const beams::BeamStructure& structure,
                                             const beams::BeamState& state, int element);

/// Negative eigenvalues of the second differences of that energy by free unknowns, under loads of
/// fixed direction. Those that are nothing but differences do not count.
[[nodiscard]] int negative_by_independent_energy(const beams::BeamStructure& structure,
                                                 const beams::BeamState& state);

}  // namespace limber::testing
