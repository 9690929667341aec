#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "engine/bodies/tet_faces.h"
#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Groups of 0 .. count - 1, numbered from 0 by their lowest member.
struct Grouping {
  std::vector<int> group_of;
  int count = 0;
};

/// Tets grouped by shared faces: parts that cannot fold against each other.
[[nodiscard]] Grouping face_connected_parts(const TetNodes& tets,
                                            const std::vector<TetFace>& faces);

/// Nodes grouped by shared tets: pieces that do not touch at all.
[[nodiscard]] Grouping node_connected_pieces(const TetNodes& tets, int node_count);

/// Two tets on the same side of a face they share (one is inverted, they overlap): the pair with
/// the lowest tets. For positively oriented tets the order of the face's corners shows this. A
/// third tet on a face always makes a pair.
[[nodiscard]] std::optional<std::pair<int, int>> overlapping_neighbours(
    const std::vector<TetFace>& faces);

/// Contacts between different face-connected parts: edges (ascending pairs) and nodes that are on
/// no such edge.
struct WeakContacts {
  std::vector<std::pair<int, int>> edges;
  std::vector<int> nodes;
};
[[nodiscard]] WeakContacts weak_contacts(const TetNodes& tets, int node_count,
                                         const Grouping& parts);

}  // namespace limber::bodies
