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

/// A line for each segment through its stations, from end to end; neighbours have points of their
/// own at the joint they share, since what they carry may jump there.
///
/// Point data: the fields by their names and director_1; without shear and equivalent stress where
/// those have no bound. Line data: segment, joints (-1: a free end), opening_angles of these
/// [degree, 0 at free ends], rest_length, length, and segment_... the extremes of the stresses.
[[nodiscard]] scene::Polylines linkage_lines(const LinkageDetail& detail);

/// Centrelines alone: joints first, shared by their segments, so that the lines are connected.
[[nodiscard]] scene::Polylines linkage_centrelines(const LinkageDetail& detail);

/// Everything about a shape as JSON: units, the result it is of, springs (where they act, and what
/// they do to the linkage, in the order of the targets), joints (position, normal, opening angle,
/// load, reaction), segments (joints, lengths, opening angles, what they do to their joints,
/// extremes of every field and the station where they are, and the fields by station), rods
/// (segments in order, which of them are reversed, closed). Names and units are in it; null is what
/// has no bound.
[[nodiscard]] std::string linkage_json(const LinkageDetail& detail, const scene::Linkage& linkage,
                                       const LinkageGeometry& geometry,
                                       const LinkageResult& result);

}  // namespace limber::session
