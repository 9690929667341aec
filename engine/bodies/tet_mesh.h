#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/bodies/material.h"

namespace limber::bodies {

using NodePositions = Eigen::Matrix3Xd;                  // 3 x n [m]
using TetNodes = Eigen::Matrix<int, 4, Eigen::Dynamic>;  // 4 x m, node indices from 0

/// A tetrahedral mesh as read or sent: a plain value, not yet validated.
///
/// Node ids everywhere in limber are columns of `nodes`, counted from 0 in the order of the file or
/// message, with any labels of the file.
struct TetMesh {
  NodePositions nodes;
  TetNodes tets;
  std::vector<Material> materials;  // empty: the scene's default material everywhere
  std::vector<int> tet_material;    // per tet an index into materials; empty if materials is empty

  /// Material of a tet of a mesh whose materials are filled (ElasticBody).
  [[nodiscard]] const Material& material_of(int tet) const {
    return materials[static_cast<std::size_t>(tet_material[static_cast<std::size_t>(tet)])];
  }
  [[nodiscard]] int node_count() const { return static_cast<int>(nodes.cols()); }
  [[nodiscard]] int tet_count() const { return static_cast<int>(tets.cols()); }
};

}  // namespace limber::bodies
