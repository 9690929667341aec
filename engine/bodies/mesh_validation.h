#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

struct MeshValidationOptions {
  /// Merge nodes closer than this [m]; off by default. Must be >= 0.
  std::optional<double> merge_tolerance;
  /// A tet is refused as zero-volume when |volume| <= this times (longest edge)^3. In [0, 1e-3].
  double relative_zero_volume = 1e-12;

  void validate() const;
};

/// A mesh that can be computed with, and how it relates to the one the client sent.
struct PreparedMesh {
  TetMesh mesh;  // compact: every node used, every tet positively oriented
  std::vector<int>
      compact_of_source;  // per source node its compact index, -1 where the node is unused
  std::vector<int> source_of_compact;  // per compact node the first source node it stands for
  std::vector<std::string> repairs;    // fixes in words, with counts and first ids
  std::vector<std::string>
      warnings;         // unusual but unchanged properties (parts joined by an edge or a node only)
  int piece_count = 0;  // pieces connected through shared faces, edges or nodes
};

/// Validates `source`; makes only harmless repairs (orientation, unused nodes, near-duplicate nodes
/// if requested) and reports them.
/// @param fixed_nodes  source node ids held in place; may be empty (a free body) if the mesh is one
/// piece
/// @throws Error naming the tet or node in source ids: non-finite coordinate, node index out of
/// range, repeated node
///   in a tet, zero volume, two pieces of which one has no fixed node, invalid material, fixed node
///   out of range or unused.
[[nodiscard]] PreparedMesh prepare_mesh(const TetMesh& source, const std::vector<int>& fixed_nodes,
                                        const MeshValidationOptions& options = {});

}  // namespace limber::bodies
