#include "engine/bodies/mesh_validation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/bodies/mesh_connectivity.h"
#include "engine/bodies/node_merging.h"
#include "engine/bodies/tet_faces.h"
#include "engine/bodies/tet_geometry.h"

namespace limber::bodies {
namespace {

constexpr std::size_t kNamedIds = 5;
constexpr double kPoorMeanRatio = 0.02;

/// Ids in a message: how many, and the first few.
class IdList {
 public:
  void add(int id) {
    if (first_.size() < kNamedIds) first_.push_back(id);
    ++count_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::string text() const {
    return fmt::format("{}{}", fmt::join(first_, ", "), count_ > first_.size() ? ", ..." : "");
  }

 private:
  std::vector<int> first_;
  std::size_t count_ = 0;
};

std::string plural(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string tet_field(int tet) { return fmt::format("mesh.tets[{}]", tet); }

[[noreturn]] void refuse(ErrorCode code, std::string field, const std::string& message) {
  throw Error(code, std::move(field), message);
}

void check_nodes(const TetMesh& source) {
  if (source.tet_count() == 0) {
    refuse(ErrorCode::kInvalidArgument, "mesh.tets", "the mesh has no tets");
  }
  if (source.nodes.cols() > std::numeric_limits<int>::max() / 3) {
    refuse(ErrorCode::kLimitExceeded, "mesh.nodes", "the mesh has too many nodes");
  }
  for (int node = 0; node < source.node_count(); ++node) {
    if (!source.nodes.col(node).allFinite()) {
      refuse(ErrorCode::kInvalidArgument, fmt::format("mesh.nodes[{}]", node),
             fmt::format("node {} has a coordinate that is not finite: ({}, {}, {})", node,
                         source.nodes(0, node), source.nodes(1, node), source.nodes(2, node)));
    }
  }
}

void check_tet_nodes(const TetMesh& source) {
  for (int e = 0; e < source.tet_count(); ++e) {
    for (int a = 0; a < 4; ++a) {
      const int node = source.tets(a, e);
      if (node < 0 || node >= source.node_count()) {
        refuse(ErrorCode::kOutOfRange, tet_field(e),
               fmt::format("tet {} refers to node {}, but the mesh has nodes 0 to {}", e, node,
                           source.node_count() - 1));
      }
      for (int b = 0; b < a; ++b) {
        if (source.tets(b, e) == node) {
          refuse(ErrorCode::kInvalidArgument, tet_field(e),
                 fmt::format("tet {} uses node {} twice", e, node));
        }
      }
    }
  }
}

void check_materials(const TetMesh& source) {
  const auto expected = source.materials.empty() ? 0 : static_cast<std::size_t>(source.tet_count());
  if (source.tet_material.size() != expected) {
    refuse(
        ErrorCode::kInvalidArgument, "mesh.tet_material",
        fmt::format("the mesh brings {} and {} tets, so tet_material must have {} entries, not {}",
                    plural(source.materials.size(), "material", "materials"), source.tet_count(),
                    expected, source.tet_material.size()));
  }
  for (std::size_t i = 0; i < source.materials.size(); ++i) {
    source.materials[i].validate(fmt::format("mesh.materials[{}]", i).c_str());
  }
  for (std::size_t e = 0; e < source.tet_material.size(); ++e) {
    const int material = source.tet_material[e];
    if (material < 0 || static_cast<std::size_t>(material) >= source.materials.size()) {
      refuse(ErrorCode::kOutOfRange, fmt::format("mesh.tet_material[{}]", e),
             fmt::format("tet {} has material {}, but the mesh has materials 0 to {}", e, material,
                         source.materials.size() - 1));
    }
  }
}

/// Lets every tet refer to representatives, which are left in compact_of_source.
void merge_nodes(PreparedMesh& prepared, const TetMesh& source, double tolerance) {
  const std::vector<int> representative = merge_near_nodes(source.nodes, tolerance);
  IdList merged;
  for (int node = 0; node < source.node_count(); ++node) {
    if (representative[node] != node) merged.add(node);
  }
  if (merged.count() == 0) return;
  for (int e = 0; e < source.tet_count(); ++e) {
    for (int a = 0; a < 4; ++a) {
      int& node = prepared.mesh.tets(a, e);
      node = representative[node];
      for (int b = 0; b < a; ++b) {
        if (prepared.mesh.tets(b, e) == node) {
          refuse(ErrorCode::kInvalidArgument, tet_field(e),
                 fmt::format("merging nodes {} and {} within {:g} would collapse tet {}",
                             source.tets(b, e), source.tets(a, e), tolerance, e));
        }
      }
    }
  }
  prepared.compact_of_source = representative;
  prepared.repairs.push_back(fmt::format("merged {} into an earlier node within {:g}: {}",
                                         plural(merged.count(), "node", "nodes"), tolerance,
                                         merged.text()));
}

/// Numbers the used nodes; on entry compact_of_source holds representatives, or is empty.
void compact_nodes(PreparedMesh& prepared, const TetMesh& source) {
  std::vector<int> representative = std::move(prepared.compact_of_source);
  prepared.compact_of_source.assign(static_cast<std::size_t>(source.node_count()), -1);
  std::vector<int>& compact = prepared.compact_of_source;
  for (const int node : prepared.mesh.tets.reshaped()) compact[node] = 0;
  IdList unused;
  for (int node = 0; node < source.node_count(); ++node) {
    const int standing = representative.empty() ? node : representative[node];
    if (standing != node) {
      compact[node] = compact[standing];  // numbered before: representatives are lower
      if (compact[node] < 0) unused.add(node);
      continue;
    }
    if (compact[node] < 0) {
      unused.add(node);
      continue;
    }
    compact[node] = static_cast<int>(prepared.source_of_compact.size());
    prepared.source_of_compact.push_back(node);
  }
  for (int& node : prepared.mesh.tets.reshaped()) node = compact[node];
  prepared.mesh.nodes = source.nodes(Eigen::all, prepared.source_of_compact);
  if (unused.count() > 0) {
    prepared.repairs.push_back(fmt::format("left out {} that no tet uses: {}",
                                           plural(unused.count(), "node", "nodes"), unused.text()));
  }
}

[[noreturn]] void refuse_volume(int tet, double volume, double longest, double relative) {
  refuse(ErrorCode::kInvalidArgument, tet_field(tet),
         fmt::format("tet {} has no volume: {:.3g} with a longest edge of {:.3g} (at least {:g} of "
                     "its cube is needed)",
                     tet, volume, longest, relative));
}

void orient_tets(PreparedMesh& prepared, const MeshValidationOptions& options) {
  IdList flipped, poor;
  double worst = std::numeric_limits<double>::infinity();
  int worst_tet = -1;
  for (int e = 0; e < prepared.mesh.tet_count(); ++e) {
    auto tet = prepared.mesh.tets.col(e);
    Eigen::Matrix3d edges = edge_matrix(prepared.mesh.nodes, tet);
    const double longest = std::sqrt(squared_edges(edges).largest);
    double volume = six_volumes(edges) / 6;
    const double least = options.relative_zero_volume * longest * longest * longest;
    if (!std::isfinite(volume) || !std::isfinite(least)) {
      refuse(ErrorCode::kInvalidArgument, tet_field(e),
             fmt::format("tet {} is too large to compute with: its longest edge is {:.3g}", e,
                         longest));
    }
    if (!(std::abs(volume) > least)) {
      refuse_volume(e, volume, longest, options.relative_zero_volume);
    }
    if (volume < 0) {
      std::swap(tet[2], tet[3]);
      flipped.add(e);
      edges = edge_matrix(prepared.mesh.nodes, tet);
      volume = six_volumes(edges) / 6;
      if (!(volume > 0)) refuse_volume(e, volume, longest, options.relative_zero_volume);
    }
    const double quality = mean_ratio(edges);
    if (quality < kPoorMeanRatio) poor.add(e);
    if (quality < worst) {
      worst = quality;
      worst_tet = e;
    }
  }
  if (flipped.count() > 0) {
    prepared.repairs.push_back(fmt::format("turned {} of negative orientation: {}",
                                           plural(flipped.count(), "tet", "tets"), flipped.text()));
  }
  if (poor.count() > 0) {
    prepared.warnings.push_back(fmt::format(
        "{} of poor shape (mean ratio below {:g}): {}; the worst is tet {} with {:.2g}",
        plural(poor.count(), "tet", "tets"), kPoorMeanRatio, poor.text(), worst_tet, worst));
  }
}

void check_overlaps(const std::vector<TetFace>& faces) {
  if (const auto pair = overlapping_neighbours(faces)) {
    refuse(ErrorCode::kInvalidArgument, tet_field(pair->first),
           fmt::format("tets {} and {} lie on the same side of their common face: one of them is "
                       "inverted, or they overlap",
                       pair->first, pair->second));
  }
}

void warn_of_weak_contacts(PreparedMesh& prepared, const std::vector<TetFace>& faces) {
  const Grouping parts = face_connected_parts(prepared.mesh.tets, faces);
  const WeakContacts contacts =
      weak_contacts(prepared.mesh.tets, prepared.mesh.node_count(), parts);
  const auto source = [&](int compact) { return prepared.source_of_compact[compact]; };
  if (!contacts.edges.empty()) {
    const auto& [a, b] = contacts.edges.front();
    prepared.warnings.push_back(
        fmt::format("parts of the body touch only along {}, first that of nodes {} and {}: they "
                    "fold there",
                    plural(contacts.edges.size(), "edge", "edges"), source(a), source(b)));
  }
  if (!contacts.nodes.empty()) {
    IdList ids;
    for (const int node : contacts.nodes) ids.add(source(node));
    prepared.warnings.push_back(
        fmt::format("parts of the body touch only at {}: {}; they fold there",
                    plural(ids.count(), "node", "nodes"), ids.text()));
  }
}

/// Fixed nodes as compact ids.
std::vector<int> check_fixed_nodes(const PreparedMesh& prepared,
                                   const std::vector<int>& fixed_nodes) {
  const int source_count = static_cast<int>(prepared.compact_of_source.size());
  std::vector<int> compact;
  for (std::size_t i = 0; i < fixed_nodes.size(); ++i) {
    const int node = fixed_nodes[i];
    if (node < 0 || node >= source_count) {
      refuse(ErrorCode::kOutOfRange, fmt::format("fixed_nodes[{}]", i),
             fmt::format("fixed node {} does not exist, the mesh has nodes 0 to {}", node,
                         source_count - 1));
    }
    if (prepared.compact_of_source[node] < 0) {
      refuse(ErrorCode::kInvalidArgument, fmt::format("fixed_nodes[{}]", i),
             fmt::format("fixed node {} belongs to no tet", node));
    }
    compact.push_back(prepared.compact_of_source[node]);
  }
  return compact;
}

/// A piece held on one line only can still turn about it.
void warn_of_swinging_piece(PreparedMesh& prepared, const std::vector<int>& held) {
  const NodePositions& nodes = prepared.mesh.nodes;
  const Eigen::Vector3d origin = nodes.col(held.front());
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  for (const int node : held) {
    const Eigen::Vector3d offset = nodes.col(node) - origin;
    if (offset.norm() > along.norm()) along = offset;
  }
  const double reach = along.norm();
  if (reach > 0) along /= reach;
  for (const int node : held) {
    const Eigen::Vector3d offset = nodes.col(node) - origin;
    if ((offset - offset.dot(along) * along).norm() > 1e-9 * reach) return;
  }
  prepared.warnings.push_back(
      fmt::format("the piece of node {} is held {} only: it can turn freely about {}",
                  prepared.source_of_compact[held.front()],
                  reach > 0 ? "along a line" : "at one node", reach > 0 ? "the line" : "the node"));
}

void check_pieces(PreparedMesh& prepared, const std::vector<int>& fixed) {
  const Grouping pieces = node_connected_pieces(prepared.mesh.tets, prepared.mesh.node_count());
  prepared.piece_count = pieces.count;
  std::vector<std::vector<int>> held(static_cast<std::size_t>(pieces.count));
  for (const int node : fixed) held[pieces.group_of[node]].push_back(node);
  if (pieces.count > 1) {
    for (int node = 0; node < prepared.mesh.node_count(); ++node) {
      if (!held[pieces.group_of[node]].empty()) continue;
      const int source = prepared.source_of_compact[node];
      refuse(ErrorCode::kInvalidArgument, fmt::format("mesh.nodes[{}]", source),
             fmt::format("the mesh falls into {} pieces, and that of node {} has no fixed node",
                         pieces.count, source));
    }
  }
  for (const std::vector<int>& nodes : held) {
    if (!nodes.empty()) warn_of_swinging_piece(prepared, nodes);
  }
}

}  // namespace

void MeshValidationOptions::validate() const {
  if (merge_tolerance && !(std::isfinite(*merge_tolerance) && *merge_tolerance >= 0)) {
    refuse(ErrorCode::kInvalidArgument, "merge_tolerance",
           fmt::format("merge_tolerance must be finite and >= 0, not {}", *merge_tolerance));
  }
  if (!(relative_zero_volume >= 0 && relative_zero_volume <= 1e-3)) {
    refuse(ErrorCode::kInvalidArgument, "relative_zero_volume",
           fmt::format("relative_zero_volume must be in [0, 1e-3], not {}", relative_zero_volume));
  }
}

PreparedMesh prepare_mesh(const TetMesh& source, const std::vector<int>& fixed_nodes,
                          const MeshValidationOptions& options) {
  options.validate();
  check_nodes(source);
  check_tet_nodes(source);
  check_materials(source);

  PreparedMesh prepared;
  prepared.mesh = {{}, source.tets, source.materials, source.tet_material};
  if (options.merge_tolerance) merge_nodes(prepared, source, *options.merge_tolerance);
  compact_nodes(prepared, source);
  orient_tets(prepared, options);
  const std::vector<TetFace> faces = sorted_faces(prepared.mesh.tets);
  check_overlaps(faces);
  check_pieces(prepared, check_fixed_nodes(prepared, fixed_nodes));
  warn_of_weak_contacts(prepared, faces);
  return prepared;
}

}  // namespace limber::bodies
