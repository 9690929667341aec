#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/state_numbers.h"
#include "engine/rods/linkage/terminal_edge.h"

namespace limber::rods {

/// Are these numbers a shape of this linkage: their count, finite, directors of unit length and
/// across their edges to a thousandth, edges with a length.
/// @throws Error{kInvalidArgument} with the name of the member as field
void validate(const StateNumbers& numbers, const LinkageGraph& graph,
              const ReducedVariables& variables);

/// Numbers of columns of StateNumbers that belong to no joint.
struct StateSizes {
  Eigen::Index vertices = 0, directors = 0, twists = 0;
};
[[nodiscard]] StateSizes state_sizes(const ReducedVariables& variables);

/// Orthonormal. @pre the numbers are valid, but for those of segments
[[nodiscard]] JointState<double> joint_of(const StateNumbers& numbers, Eigen::Index joint);

}  // namespace limber::rods
