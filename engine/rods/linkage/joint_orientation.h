#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/rods/linkage/joint_pairing.h"

namespace limber::rods::detail {

/// Two joints that a segment connects, and which of each joint's rods it belongs to.
struct JointLink {
  int segment;
  std::array<int, 2> joints;
  std::array<int, 2> rods;    // index into RodPair
  Eigen::Vector3d direction;  // of the segment, from the first to the second, unit
};

/// Data of a joint beside its rods.
struct JointPlace {
  int vertex;  // of the line mesh, for messages
  int rank;    // in an order that says nothing of how the mesh was numbered
  Eigen::Vector3d position;
};

/// What the joints of a linkage agree on.
struct JointOrientations {
  std::vector<Eigen::Vector3d> normals;  // unit, continuous over each component
  std::vector<int> rod_a;                // which of a joint's two rods is rod A
  /// Opening angle [rad] from rod A's tangent to +-1 times rod B's, counter-clockwise about the
  /// normal.
  std::vector<double> angles;
  std::vector<int> signs_b;
};

/// Normals are carried along the segments. Where that says clearly which of its two a joint's
/// normal is, on all segments, they follow it; the surface has one side only where these contradict
/// each other, other than around single cells, which are crumpled then. Other segments are followed
/// in the order of how clear they are. So nothing depends
/// on how joints and segments are numbered, but the side of surfaces that have no upper and no
/// outer one, and which family of rods is A where as many angles are acute as obtuse.
/// @pre letters of the rods are consistent: see choose_pairings
/// @param pairs   one for each joint
/// @param places  of the joints
/// @throws Error{kInvalidArgument} naming the smallest loop around which the normal comes back
/// reversed
[[nodiscard]] JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                              const std::vector<JointLink>& links,
                                              const std::vector<JointPlace>& places);

}  // namespace limber::rods::detail
