#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods::detail {

/// One end of a segment as seen from the vertex it touches.
struct Spoke {
  int segment;
  End end;
  Eigen::Vector3d direction;  // unit, away from the vertex
};

/// One of the pairings by which the spokes of a joint form two rods.
struct Pairing {
  std::array<std::vector<int>, 2> rods;  // spokes by their place in the list, ascending
  /// Sum of the cosines between the directions of a rod's two spokes: -1 for each straight rod.
  double bend = 0;
};

/// The edges at one vertex put together to two rods, not yet called A and B.
struct RodPair {
  /// Spokes of each rod: ahead along the tangent, then behind; an end has only the first.
  std::array<std::vector<Spoke>, 2> rods;
  /// Unit tangents: the mean of the two segments' directions.
  std::array<Eigen::Vector3d, 2> tangents;
};

/// All pairings, the straightest first: one of two spokes, three of three or four. Those that fold
/// a rod back on itself are last, with a bend of a million more.
/// @param spokes  two to four
/// @param ranks   of each spoke, all different: equal bends are in order of the rank of the spoke
/// that forms the rod's end (three spokes) or the rod with the first spoke (four)
[[nodiscard]] std::vector<Pairing> possible_pairings(const std::vector<Spoke>& spokes,
                                                     const std::vector<int>& ranks);

/// @param vertex  its number, for the message
/// @throws Error{kInvalidArgument} where a rod folds back on itself, so that it has no tangent
[[nodiscard]] RodPair form_rods(const std::vector<Spoke>& spokes, const Pairing& pairing,
                                int vertex);

}  // namespace limber::rods::detail
