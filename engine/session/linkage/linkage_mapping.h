#pragma once

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// A linkage as the rods wing takes it: lengths in the scene's unit, forces in N, moments in N
/// times that unit. No number is brought to metres, so that a model in millimetres is not a
/// thousandth of one in metres.
struct MappedLinkage {
  rods::LinkageModel model;
  double mass_per_length = 0;  // [kg / scene length unit]
};

/// @throws Error with a field of the scene: lines.vertices[v], lines.edges[e], section....,
/// material numbers, edges_per_segment
[[nodiscard]] MappedLinkage map_linkage(const scene::Linkage& linkage);

/// @pre the conditions are valid for the linkage
[[nodiscard]] rods::Conditions map_conditions(const scene::LinkageConditions& conditions,
                                              const MappedLinkage& mapped, double length_unit);

}  // namespace limber::session
