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

/// The edges at one vertex put together to two rods, not yet called A and B.
struct RodPair {
  /// Spokes of each rod: ahead along the tangent, then behind; an end has only the first.
  std::array<std::vector<Spoke>, 2> rods;
  /// Unit tangents: the mean of the two segments' directions.
  std::array<Eigen::Vector3d, 2> tangents;
};

/// @param spokes  two to four
/// @param vertex  its number, for the message
/// @throws Error{kInvalidArgument} where a rod folds back on itself, so that it has no tangent
[[nodiscard]] RodPair pair_spokes(const std::vector<Spoke>& spokes, int vertex);

}  // namespace limber::rods::detail
