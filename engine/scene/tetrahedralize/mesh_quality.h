#pragma once

#include <Eigen/Core>

#include "engine/bodies/tet_mesh.h"

namespace limber::scene {

/// How good the tets of a mesh are; all numbers are independent of scale.
struct MeshQuality {
  double min_mean_ratio = 0;  // worst tet; 1: regular, 0: flat, negative: inverted
  double average_mean_ratio = 0;
  double min_dihedral_deg = 0;  // over all tets and edges; 70.5 in a regular tet
  double max_dihedral_deg = 0;
};

/// Mean ratio 12 (3 V)^(2/3) / (sum of squared edges), with the sign of the volume (Liu and Joe
/// 1994).
[[nodiscard]] double mean_ratio(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// Above 1 for a tet of mean ratio above 0.3 and dihedral angles between 10 and 165 degrees. It is
/// the smallest of these three, each relative to its bound (angles to the distance from 0 and 180).
[[nodiscard]] double tet_shape(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c, const Eigen::Vector3d& d);

[[nodiscard]] MeshQuality measure_quality(const bodies::TetMesh& mesh);

}  // namespace limber::scene
