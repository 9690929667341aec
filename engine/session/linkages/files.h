#pragma once

#include <string>

#include "engine/scene/formats/polylines.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/session.h"
#include "engine/session/linkages/statics.h"

namespace limber::session {

/// How a field is called in files, and its unit there ("1/length": of the scene's length unit).
struct RodFieldName {
  const char* name;
  const char* unit;
};
[[nodiscard]] RodFieldName name_of(rods::RodField field);

/// A line for each segment through its stations, from end to end. Neighbours have points of their
/// own at the joint they share, since forces may jump there.
///
/// Point data: the fields by their names and director_1; without shear and equivalent stress where
/// those have no bound. Line data: segment, joints (-1: a free end), opening_angles of these
/// [degree, 0 at free ends], rest_length, length, and segment_... the extremes of the stresses.
[[nodiscard]] scene::Polylines linkage_lines(const LinkageDetail& detail);

/// Centrelines alone: joints first, shared by their segments, so that the lines are connected.
[[nodiscard]] scene::Polylines linkage_centrelines(const LinkageDetail& detail);

/// The complete description of a shape as JSON, with names and units; null means no bound:
/// - units, and the result that shows the shape
/// - springs: positions and forces on the linkage, in the order of the targets
/// - joints: position, normal, opening angle, load, reaction
/// - segments: joints, lengths, opening angles, forces on their joints, extremes of every field
///   with their stations, and the fields by station
/// - rods: segments in order, which of them are reversed, closed
[[nodiscard]] std::string linkage_json(const LinkageDetail& detail, const scene::Linkage& linkage,
                                       const LinkageGeometry& geometry,
                                       const LinkageResult& result);

}  // namespace limber::session
