#pragma once

#include <span>

#include "bench/suite.h"
#include "engine/beams/refinement/subdivision_choice.h"
#include "engine/beams/solver/equilibrium.h"

namespace limber::bench {

/// A beam with a known answer, of so many elements.
struct KnownStructure {
  const char* name;
  beams::BeamModel (*make)(int elements);
};
[[nodiscard]] std::span<const KnownStructure> known_structures();

[[nodiscard]] beams::BeamModel without_temporary_loads(beams::BeamModel model);

/// Distance between two states, for each of the first nodes.
[[nodiscard]] Eigen::VectorXd distances(const beams::BeamState& a, const beams::BeamState& b,
                                        Eigen::Index nodes);

/// Values of an estimate: `elements`, `estimate` (of positions), `energy_estimate` and its method.
void add_error(const beams::DiscretisationError& error, Case& result);

/// True values, by 16 parts an element next to the state: `true`, `estimate_over_true`,
/// `energy_true`. Nothing if there is no such equilibrium; `limit` says how it was found.
void add_truth(const beams::BeamModel& model, const beams::BeamState& state, double energy,
               Case& result);

}  // namespace limber::bench
