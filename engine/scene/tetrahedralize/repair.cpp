#include "engine/scene/tetrahedralize/repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <numeric>

namespace limber::scene::lattice {
namespace {

constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

using FaceKey = std::array<int, 3>;

FaceKey face_key(const Eigen::Vector4i& tet, int face) {
  FaceKey key = {tet[kFaces[face][0]], tet[kFaces[face][1]], tet[kFaces[face][2]]};
  std::sort(key.begin(), key.end());
  return key;
}

double volume(const Stuffing& s, const Eigen::Vector4i& tet) {
  const auto at = [&](int i) { return s.nodes[static_cast<std::size_t>(tet[i])]; };
  return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6;
}

/// Per tet and face the neighbour across it, or -1 at the surface.
std::vector<std::array<int, 4>> tet_neighbours(const std::vector<Eigen::Vector4i>& tets) {
  std::vector<std::pair<FaceKey, int>> faces;
  faces.reserve(4 * tets.size());
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int f = 0; f < 4; ++f)
      faces.emplace_back(face_key(tets[t], f), static_cast<int>(4 * t) + f);
  }
  std::sort(faces.begin(), faces.end());
  std::vector<std::array<int, 4>> result(tets.size(), {-1, -1, -1, -1});
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].first != faces[i - 1].first) continue;
    const auto a = static_cast<std::size_t>(faces[i - 1].second),
               b = static_cast<std::size_t>(faces[i].second);
    result[a / 4][a % 4] = static_cast<int>(b / 4);
    result[b / 4][b % 4] = static_cast<int>(a / 4);
  }
  return result;
}

std::vector<std::vector<int>> tets_of_nodes(const Stuffing& s) {
  std::vector<std::vector<int>> result(s.nodes.size());
  for (std::size_t t = 0; t < s.tets.size(); ++t) {
    for (int c = 0; c < 4; ++c)
      result[static_cast<std::size_t>(s.tets[t][c])].push_back(static_cast<int>(t));
  }
  return result;
}

/// Groups of `members` connected through faces for which `crosses(tet, face)` holds; the largest by
/// volume first.
template <typename Crosses>
std::vector<std::vector<int>> face_groups(const Stuffing& s,
                                          const std::vector<std::array<int, 4>>& neighbours,
                                          const std::vector<int>& members, std::vector<int>& mark,
                                          int& stamp, const Crosses& crosses) {
  const int first_stamp = stamp;
  for (const int t : members) mark[static_cast<std::size_t>(t)] = first_stamp;
  std::vector<std::vector<int>> groups;
  for (const int seed : members) {
    if (mark[static_cast<std::size_t>(seed)] != first_stamp) continue;
    std::vector<int> group = {seed};
    mark[static_cast<std::size_t>(seed)] = first_stamp + 1;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto tet = static_cast<std::size_t>(group[i]);
      for (int f = 0; f < 4; ++f) {
        const int next = neighbours[tet][static_cast<std::size_t>(f)];
        if (next < 0 || mark[static_cast<std::size_t>(next)] != first_stamp ||
            !crosses(group[i], f))
          continue;
        mark[static_cast<std::size_t>(next)] = first_stamp + 1;
        group.push_back(next);
      }
    }
    groups.push_back(std::move(group));
  }
  stamp += 2;
  const auto total = [&](const std::vector<int>& group) {
    double sum = 0;
    for (const int t : group) sum += volume(s, s.tets[static_cast<std::size_t>(t)]);
    return sum;
  };
  if (groups.size() > 1) {
    std::stable_sort(groups.begin(), groups.end(),
                     [&](const auto& a, const auto& b) { return total(a) > total(b); });
  }
  return groups;
}

void keep_tets(Stuffing& s, const std::vector<char>& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < s.tets.size(); ++t) {
    if (keep[t]) s.tets[kept++] = s.tets[t];
  }
  s.tets.resize(kept);
}

/// Parts that share a node but no face around it get a node each. @returns copies made.
int separate_nodes(Stuffing& s) {
  const auto neighbours = tet_neighbours(s.tets);
  const auto around = tets_of_nodes(s);
  std::vector<int> mark(s.tets.size(), -1);
  int stamp = 0, copies = 0;
  for (std::size_t node = 0; node < around.size(); ++node) {
    const auto groups = face_groups(s, neighbours, around[node], mark, stamp, [&](int t, int f) {
      return s.tets[static_cast<std::size_t>(t)][f] !=
             static_cast<int>(node);  // the face opposite of it lacks it
    });
    for (std::size_t g = 1; g < groups.size(); ++g) {
      const Eigen::Vector3d place = s.nodes[node];
      s.nodes.push_back(place);
      ++copies;
      for (const int t : groups[g]) {
        Eigen::Vector4i& tet = s.tets[static_cast<std::size_t>(t)];
        for (int c = 0; c < 4; ++c) {
          if (tet[c] == static_cast<int>(node)) tet[c] = static_cast<int>(s.nodes.size()) - 1;
        }
      }
    }
  }
  return copies;
}

/// Around an edge with more than two surface triangles, only the largest wedge of tets stays.
/// @returns tets dropped.
int open_crowded_edges(Stuffing& s) {
  const auto neighbours = tet_neighbours(s.tets);
  std::map<std::pair<int, int>, int> triangles_of_edge;
  for (std::size_t t = 0; t < s.tets.size(); ++t) {
    for (std::size_t f = 0; f < 4; ++f) {
      if (neighbours[t][f] >= 0) continue;
      for (int e = 0; e < 3; ++e) {
        const int a = s.tets[t][kFaces[f][e]], b = s.tets[t][kFaces[f][(e + 1) % 3]];
        ++triangles_of_edge[{std::min(a, b), std::max(a, b)}];
      }
    }
  }
  std::vector<char> keep(s.tets.size(), 1);
  std::vector<std::vector<int>> around;
  std::vector<int> mark(s.tets.size(), -1);
  int stamp = 0, dropped = 0;
  for (const auto& counted : triangles_of_edge) {
    const auto& edge = counted.first;
    const int triangles = counted.second;
    if (triangles <= 2) continue;
    if (around.empty()) around = tets_of_nodes(s);
    std::vector<int> members;
    for (const int t : around[static_cast<std::size_t>(edge.first)]) {
      if ((s.tets[static_cast<std::size_t>(t)].array() == edge.second).any()) members.push_back(t);
    }
    const auto groups = face_groups(s, neighbours, members, mark, stamp, [&](int t, int f) {
      const int opposite = s.tets[static_cast<std::size_t>(t)][f];
      return opposite != edge.first && opposite != edge.second;
    });
    for (std::size_t g = 1; g < groups.size(); ++g) {
      for (const int t : groups[g]) {
        dropped += keep[static_cast<std::size_t>(t)];
        keep[static_cast<std::size_t>(t)] = 0;
      }
    }
  }
  keep_tets(s, keep);
  return dropped;
}

/// @returns {pieces, tets} dropped.
std::pair<int, int> keep_largest_piece(Stuffing& s) {
  const auto neighbours = tet_neighbours(s.tets);
  std::vector<int> all(s.tets.size()), mark(s.tets.size(), -1);
  std::iota(all.begin(), all.end(), 0);
  int stamp = 0;
  const auto pieces = face_groups(s, neighbours, all, mark, stamp, [](int, int) { return true; });
  if (pieces.size() <= 1) return {0, 0};
  std::vector<char> keep(s.tets.size(), 0);
  for (const int t : pieces[0]) keep[static_cast<std::size_t>(t)] = 1;
  const int dropped = static_cast<int>(s.tets.size() - pieces[0].size());
  keep_tets(s, keep);
  return {static_cast<int>(pieces.size()) - 1, dropped};
}

void drop_unused_nodes(Stuffing& s) {
  std::vector<int> compact(s.nodes.size(), -1);
  std::vector<Eigen::Vector3d> nodes;
  for (const Eigen::Vector4i& tet : s.tets) {
    for (int c = 0; c < 4; ++c) compact[static_cast<std::size_t>(tet[c])] = 0;
  }
  for (std::size_t i = 0; i < compact.size(); ++i) {
    if (compact[i] < 0) continue;
    compact[i] = static_cast<int>(nodes.size());
    nodes.push_back(s.nodes[i]);
  }
  for (Eigen::Vector4i& tet : s.tets) {
    for (int c = 0; c < 4; ++c) tet[c] = compact[static_cast<std::size_t>(tet[c])];
  }
  s.nodes = std::move(nodes);
}

}  // namespace

Repair make_one_piece(Stuffing& stuffing) {
  Repair repair;
  // Each step only drops tets or separates nodes, so the loop ends; it almost always takes one
  // round.
  for (int changed = 1; changed > 0 && !stuffing.tets.empty();) {
    const auto [pieces, tets] = keep_largest_piece(stuffing);
    const int opened = open_crowded_edges(stuffing);
    const int copies = separate_nodes(stuffing);
    repair.pieces_dropped += pieces;
    repair.tets_dropped += tets + opened;
    repair.nodes_separated += copies;
    changed = tets + opened + copies;
  }
  drop_unused_nodes(stuffing);
  return repair;
}

}  // namespace limber::scene::lattice
