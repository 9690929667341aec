#pragma once

#include <Eigen/Core>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// The six motions of a free body that cost no elastic energy (to first order), built from its
/// geometry.
struct RigidModes {
  double mass = 0;                                   // [kg]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of mass [m]
  Eigen::Matrix3d inertia =
      Eigen::Matrix3d::Zero();  // about the centre, of the consistent mass [kg m^2]
  /// Column k is the angular velocity of rotation mode k [1/(m sqrt(kg))]: the inverse square root
  /// of the inertia. The rotations are thus mass-orthonormal, and each is as close as possible to
  /// its axis x, y or z.
  Eigen::Matrix3d angular = Eigen::Matrix3d::Zero();
  /// 3n x 6, modes^T M modes = I with the consistent mass [1/sqrt(kg)]: translations along x, y, z,
  /// then rotations angular.col(k) x (X - centre).
  Eigen::MatrixXd modes;
};

/// @param mesh  oriented, materials filled
[[nodiscard]] RigidModes rigid_modes(const TetMesh& mesh);

}  // namespace limber::bodies
