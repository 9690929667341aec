#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/joint_pairing.h"

namespace limber::rods::detail {

struct JointLink;

/// Normals that are carried along a strongly bent or turned segment may end on the wrong side of
/// the next joint. This shows around the cells of a grid or a weave: a walk that keeps to one side
/// of its segments strays from one cell into another. There are then fewer closed walks (faces of
/// the ribbon graph, Gross and Tucker, Topological Graph Theory, 3.2).
///
/// @param normals  of joints, unit, on any side
/// @param cosines  of each link, between the normal carried along it from its first joint and that
///                 of its second. Those whose other sign makes more cells get it, the least clear
///                 first
/// @param most     the greatest |cosine| of a link that may get the other sign
void correct_sides(const std::vector<RodPair>& pairs, const std::vector<JointLink>& links,
                   const std::vector<Eigen::Vector3d>& normals, double most,
                   std::vector<double>& cosines);

}  // namespace limber::rods::detail
