#pragma once

#include "bench/stability/sweep.h"
#include "engine/beams/solver/equilibrium.h"

namespace limber::bench::stability {

/// Claim of a solution; error and limit are for the caller.
[[nodiscard]] Finding finding_of(const beams::BeamSolution& found);

/// Largest unbalanced force or moment at a free unknown, by differences of the elastic energy. It
/// is relative to the largest one of any unknown (reactions and loads included) or, if there are
/// none, to a thousandth of EI / extent^2. Loads of fixed direction without moments, no releases.
[[nodiscard]] double imbalance_by_energy(const beams::BeamStructure& structure,
                                         const beams::BeamState& state);

/// The larger of that, and 1 where differences of forces show a direction in which the energy
/// falls.
[[nodiscard]] double minimum_error(const beams::BeamStructure& structure,
                                   const beams::BeamState& state);

}  // namespace limber::bench::stability
