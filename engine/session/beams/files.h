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

/// A row per element: nodes, largest forces, moments at its ends, largest stresses, utilisation,
/// energy, extremes of forces and moments with their places.
[[nodiscard]] std::string beam_elements_csv(const BeamAnalysis& analysis);

/// A row per station at equal distances along each element. Columns: element, place (share of the
/// length at rest), forces and moments, equivalent stress, utilisation.
/// @param stations  of an element, >= 2
[[nodiscard]] std::string beam_stations_csv(const BeamAnalysis& analysis, int stations);

/// Everything that the tables have, with how the solver ended, energies and units.
/// @param stations  of an element, >= 2; 0: none
[[nodiscard]] std::string beam_json(const BeamAnalysis& analysis, int stations);

}  // namespace limber::session
