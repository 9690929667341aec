#pragma once

#include <Eigen/Core>
#include <array>
#include <numbers>
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
  double turn = 0;  // the larger of its rods' [rad]
};

/// The edges at one vertex put together to two rods, not yet called A and B.
struct RodPair {
  /// Spokes of each rod: ahead along the tangent, then behind; an end has only the first.
  std::array<std::vector<Spoke>, 2> rods;
  /// Unit tangents: the mean of the two segments' directions.
  std::array<Eigen::Vector3d, 2> tangents;
};

/// By how much more than those of the straightest pairing the rods of others may turn [rad]: lines
/// that are drawn straight are no more exact where they are coarse.
inline constexpr double kLargestTurn = std::numbers::pi / 12;

/// The pairings that a joint may have, the straightest first. Two spokes have one pairing. Three or
/// four spokes have three; those are kept whose rods turn by at most kLargestTurn more than the
/// straightest one's.
/// @param spokes  two to four
/// @param ranks   of each spoke, all different. Equal bends are in order of the rank of the spoke
/// that forms the rod's end (three spokes) or the rod with the first spoke (four)
[[nodiscard]] std::vector<Pairing> possible_pairings(const std::vector<Spoke>& spokes,
                                                     const std::vector<int>& ranks);

/// @param vertex  its number, for the message
/// @throws Error{kInvalidArgument} where a rod folds back on itself, so that it has no tangent
[[nodiscard]] RodPair form_rods(const std::vector<Spoke>& spokes, const Pairing& pairing,
                                int vertex);

}  // namespace limber::rods::detail
