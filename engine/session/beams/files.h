#pragma once

#include <string>

#include "engine/session/beams/analysis.h"

namespace limber::session {

/// The deformed elements as lines, VTK XML. Point data: displacement, rotation (vector [rad]),
/// reaction_force, reaction_moment; cell data: section, and what the table of elements has. Numbers
/// are float64.
[[nodiscard]] std::string beam_vtu(const BeamAnalysis& analysis);

/// A row per node, comma-separated, a heading first: node, x, y, z, rotation vector, reaction
/// force, reaction moment.
[[nodiscard]] std::string beam_nodes_csv(const BeamAnalysis& analysis);

/// A row per element: nodes, forces and moments at its ends, stresses, utilisation, energy.
[[nodiscard]] std::string beam_elements_csv(const BeamAnalysis& analysis);

/// Everything that the tables have, with how the solver ended, energies and units.
[[nodiscard]] std::string beam_json(const BeamAnalysis& analysis);

}  // namespace limber::session
