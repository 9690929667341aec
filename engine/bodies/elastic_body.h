#pragma once

#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// A validated body at rest: what every operator of this wing and of `reduced` is built from.
struct ElasticBody {
  TetMesh mesh;  // compact and oriented (from prepare_mesh); materials filled for every tet
  std::vector<int> fixed_nodes;  // compact ids, sorted, unique; empty for a free body

  /// Largest side of the bounding box at rest [m]: the unit in which errors and constraint energies
  /// are measured.
  [[nodiscard]] double length() const;
  [[nodiscard]] bool is_free() const { return fixed_nodes.empty(); }
};

}  // namespace limber::bodies
