#pragma once

#include <Eigen/Core>

namespace limber::rods {

/// A shape of a linkage for files: the numbers of a LinkageState without its layout. Columns are
/// joints, or the parts of each segment in turn, from start to finish, that belong to no joint: a
/// terminal edge follows from its joint.
struct StateNumbers {
  Eigen::Matrix3Xd positions;      // of joints [length]
  Eigen::Matrix3Xd normals;        // of joints, unit
  Eigen::Matrix3Xd bisectors;      // of joints, unit, orthogonal to the normals
  Eigen::VectorXd opening_angles;  // of joints [rad]
  Eigen::Matrix2Xd lengths;        // of the edges of rods A and B at joints [length]
  Eigen::Matrix3Xd vertices;       // of segments, those that no joint moves [length]
  Eigen::Matrix3Xd directors;      // d_1 of their edges, those that are no joint's; unit
  Eigen::VectorXd twists;          // at all vertices within segments [rad]
};

}  // namespace limber::rods
