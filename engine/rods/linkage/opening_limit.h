#pragma once

#include <cstddef>
#include <numbers>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// Limit of a joint's opening angle, in either direction [rad]: beyond it its rods have passed
/// through each other. Two segments fold from one side to the other.
[[nodiscard]] inline double largest_opening(const LinkageGraph& graph, std::size_t joint) {
  return graph.joints[joint].valence == 2 ? 2 * std::numbers::pi : 1.25 * std::numbers::pi;
}

}  // namespace limber::rods
