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
  /// Normal of the surface there, unit; zero for all joints: not given.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Common orientation of the joints of a linkage.
struct JointOrientations {
  std::vector<Eigen::Vector3d> normals;  // unit, continuous over each component
  std::vector<int> rod_a;                // which of a joint's two rods is rod A
  /// Opening angle [rad] from rod A's tangent to +-1 times rod B's, counter-clockwise about the
  /// normal.
  std::vector<double> angles;
  std::vector<int> signs_b;
  /// In some component no letters stay the same along each rod. Angles are acute there, on one side
  /// of a rod at some joints and on its other side at others.
  bool is_mixed = false;
};

/// Normals are those given, across the rods. Without these they are carried along the segments.
/// Normals follow all segments on which this decides clearly between a joint's two normals; other
/// segments are followed in order of clarity. If clear segments contradict each other, the cells
/// between the rods decide on the less clear ones (see correct_sides). If contradictions remain,
/// the surface has one side only. Only two choices depend on the numbering of joints and segments.
/// One is the side of surfaces that have no upper and no outer one. The other is which family of
/// rods is A if as many angles are acute as obtuse. Letters A and B stay the same along each rod
/// where they can.
/// @param pairs   one for each joint
/// @param places  of the joints
/// @throws Error{kInvalidArgument} naming the smallest loop around which the normal comes back
/// reversed. The field is normals[v] if a given normal is in the plane of its rods, or on the other
/// side of a rod than the next
[[nodiscard]] JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                              const std::vector<JointLink>& links,
                                              const std::vector<JointPlace>& places);

}  // namespace limber::rods::detail
