#pragma once

#include <array>
#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Corners of the face opposite corner f of a positively oriented tet, counter-clockwise from
/// outside.
inline constexpr int kTetFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/// A face of a tet, comparable with the same face of another.
struct TetFace {
  std::array<int, 3> nodes;  // ascending
  int id;                    // 4 * tet + face
  bool even;                 // the outward order of the corners is an even permutation of `nodes`

  [[nodiscard]] int tet() const { return id / 4; }
  [[nodiscard]] int face() const { return id % 4; }
};

/// All 4m faces sorted by nodes, then id: tets that share a face are neighbours in the list.
[[nodiscard]] std::vector<TetFace> sorted_faces(const TetNodes& tets);

}  // namespace limber::bodies
