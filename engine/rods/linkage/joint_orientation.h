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
  std::array<int, 2> rods;  // index into RodPair
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

/// @param pairs      one for each joint
/// @param vertices   vertex numbers of the joints, for messages
/// @throws Error{kInvalidArgument} naming the vertex where no consistent choice of the opening
/// angle exists, or where the normals come back reversed
[[nodiscard]] JointOrientations orient_joints(const std::vector<RodPair>& pairs,
                                              const std::vector<JointLink>& links,
                                              const std::vector<int>& vertices);

}  // namespace limber::rods::detail
