#include "engine/bodies/mesh_connectivity.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "engine/base/disjoint_sets.h"

namespace limber::bodies {
namespace {

/// Groups in the order of their lowest items.
Grouping grouping(DisjointSets& sets, Eigen::Index count) {
  Grouping result;
  result.group_of.resize(static_cast<std::size_t>(count));
  for (int item = 0; item < static_cast<int>(count); ++item) {
    const int lowest = sets.lowest(item);
    result.group_of[item] = lowest == item ? result.count++ : result.group_of[lowest];
  }
  return result;
}

struct PartEdge {
  std::pair<int, int> edge;
  int part;
  auto operator<=>(const PartEdge&) const = default;
};

// Nodes that belong to tets of more than one part.
std::vector<char> shared_nodes(const TetNodes& tets, int node_count, const Grouping& parts) {
  std::vector<int> first(static_cast<std::size_t>(node_count), -1);
  std::vector<char> shared(static_cast<std::size_t>(node_count), 0);
  for (int e = 0; e < tets.cols(); ++e) {
    const int part = parts.group_of[e];
    for (int a = 0; a < 4; ++a) {
      int& known = first[tets(a, e)];
      if (known < 0) known = part;
      if (known != part) shared[tets(a, e)] = 1;
    }
  }
  return shared;
}

}  // namespace

Grouping face_connected_parts(const TetNodes& tets, const std::vector<TetFace>& faces) {
  DisjointSets sets(static_cast<std::size_t>(tets.cols()));
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].nodes == faces[i - 1].nodes) sets.join(faces[i].tet(), faces[i - 1].tet());
  }
  return grouping(sets, tets.cols());
}

Grouping node_connected_pieces(const TetNodes& tets, int node_count) {
  DisjointSets sets(static_cast<std::size_t>(node_count));
  for (int e = 0; e < tets.cols(); ++e) {
    for (int a = 1; a < 4; ++a) sets.join(tets(0, e), tets(a, e));
  }
  return grouping(sets, node_count);
}

std::optional<std::pair<int, int>> overlapping_neighbours(const std::vector<TetFace>& faces) {
  std::optional<std::pair<int, int>> lowest;
  const auto note = [&](const TetFace& a, const TetFace& b) {
    const std::pair<int, int> pair = std::minmax(a.tet(), b.tet());
    if (!lowest || pair < *lowest) lowest = pair;
  };
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].nodes != faces[i - 1].nodes) continue;
    if (faces[i].even == faces[i - 1].even) note(faces[i - 1], faces[i]);
    // If three tets share a face, two are on one side; if neighbours in the list differ, first and
    // third agree.
    if (i >= 2 && faces[i].nodes == faces[i - 2].nodes && faces[i].even == faces[i - 2].even) {
      note(faces[i - 2], faces[i]);
    }
  }
  return lowest;
}

WeakContacts weak_contacts(const TetNodes& tets, int node_count, const Grouping& parts) {
  WeakContacts contacts;
  if (parts.count < 2) return contacts;
  std::vector<char> shared = shared_nodes(tets, node_count, parts);
  std::vector<PartEdge> candidates;
  for (int e = 0; e < tets.cols(); ++e) {
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) {
        const std::pair<int, int> edge = std::minmax(tets(a, e), tets(b, e));
        if (shared[edge.first] && shared[edge.second]) {
          candidates.push_back({edge, parts.group_of[e]});
        }
      }
    }
  }
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const auto& edge = candidates[i].edge;
    if (edge != candidates[i - 1].edge) continue;
    if (contacts.edges.empty() || contacts.edges.back() != edge) contacts.edges.push_back(edge);
  }
  for (const auto& [a, b] : contacts.edges) shared[a] = shared[b] = 0;
  for (int node = 0; node < node_count; ++node) {
    if (shared[node]) contacts.nodes.push_back(node);
  }
  return contacts;
}

}  // namespace limber::bodies
