#pragma once

#include <vector>

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// Properties of a linkage that need no model.
struct LinkageCheck {
  /// All that is wrong, fields of the scene: material numbers, edges_per_segment, tolerance,
  /// section....,
  /// lines.vertices[v], lines.edges[e], normals[v], shape...., conditions.... Shape and conditions
  /// are looked at where the lines make a linkage.
  std::vector<scene::Issue> issues;
  int joints = 0, segments = 0;  // where the lines make a linkage
};
/// Its edges per segment, or kUsualEdges as long as they are not chosen.
[[nodiscard]] int first_edges(const scene::Linkage& linkage);
/// Quick: the torsion of the section is left to map_linkage.
[[nodiscard]] LinkageCheck check_linkage(const scene::Linkage& linkage);
/// @throws Error of the first of its issues
void demand_sound(const LinkageCheck& check);

/// A linkage as the rods wing takes it: lengths in the scene's unit, forces in N, moments in N
/// times that unit. No number is brought to metres, so that a model in millimetres is not a
/// thousandth of one in metres.
struct MappedLinkage {
  rods::LinkageModel model;
  rods::SectionProperties section;
  double mass_per_length = 0;  // [kg / scene length unit]
};

/// @pre its edges_per_segment are chosen. Solves for the torsion of the section, which may take
/// seconds for a polygon of many corners.
/// @throws Error of the first issue of `check_linkage`; with field section.outer where its
/// torsion cannot be found
[[nodiscard]] MappedLinkage map_linkage(const scene::Linkage& linkage);

/// @pre the conditions are valid for the linkage
[[nodiscard]] rods::Conditions map_conditions(const scene::LinkageConditions& conditions,
                                              const MappedLinkage& mapped, double length_unit);

/// The inverse, for conditions along the path between others: springs that have faded are left out,
/// loads of one joint are one. Targets have no ids.
[[nodiscard]] scene::LinkageConditions scene_conditions(const rods::Conditions& conditions,
                                                        const MappedLinkage& mapped,
                                                        double length_unit);

}  // namespace limber::session
