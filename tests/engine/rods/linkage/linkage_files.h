#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/rods/linkage/line_mesh.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::rods::testing {

/// A file of the data beside the repository ($LIMBER_SHARED or ../shared); it may not be there.
inline std::filesystem::path shared_file(const std::string& file) {
  const char* const root = std::getenv("LIMBER_SHARED");
  return std::filesystem::path(root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared") / file;
}

inline std::filesystem::path linkage_file(const std::string& name) {
  return shared_file("data/linkages/" + name + ".obj");
}

struct KnownLinkage {
  const char* name;
  int joints;
  int segments;
  int edges_per_segment;
  int unknowns;
};

/// Sizes as the public code reports them; 0 unknowns: not reported.
inline const std::vector<KnownLinkage>& known_linkages() {
  static const std::vector<KnownLinkage> all = {
      {"two_rods", 1, 2, 10, 0},
      {"single_linkage", 1, 4, 10, 0},
      {"fish_linkage", 4, 6, 10, 224},
      {"hyperboloid_closed", 33, 52, 10, 0},
      {"burd_flat_opt_scaled", 41, 66, 10, 2283},
      {"etienne_hyperboloid_measured", 101, 180, 10, 6157},
      {"darth_vader_pavilion", 157, 288, 10, 9765},
      {"AsymmOverhanging2BumpsArchitecturalScale", 237, 440, 10, 14893},
      {"hourglass", 805, 1532, 8, 39417},
  };
  return all;
}

inline LineMesh mesh_of(const std::vector<Eigen::Vector3d>& vertices,
                        const std::vector<Eigen::Vector2i>& edges) {
  LineMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t i = 0; i < edges.size(); ++i)
    mesh.edges.col(static_cast<Eigen::Index>(i)) = edges[i];
  return mesh;
}

/// The cells of a flat scissor grid: columns x rows joints, rods along both diagonals of a lattice
/// sheared so that its rods cross at `angle` [rad].
inline LineMesh sheared_grid(int columns, int rows, double angle, double length = 1.0) {
  LineMesh mesh;
  mesh.vertices.resize(3, columns * rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      mesh.vertices.col(r * columns + c) =
          length * Eigen::Vector3d(c + r * std::cos(angle), r * std::sin(angle), 0);
    }
  }
  std::vector<Eigen::Vector2i> edges;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int v = r * columns + c;
      if (c + 1 < columns) edges.emplace_back(v, v + 1);
      if (r + 1 < rows) edges.emplace_back(v, v + columns);
    }
  }
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    mesh.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
  return mesh;
}

/// A grid with joints of valence 2 to 4, a rod with a free end in each direction, and a lone rod.
inline LineMesh mixed_mesh() {
  const LineMesh grid = sheared_grid(3, 3, 1.1, 1.3);
  const int vertices = grid.vertex_count(), edges = grid.edge_count();
  LineMesh mesh;
  mesh.vertices.resize(3, vertices + 4);
  mesh.vertices.leftCols(vertices) = grid.vertices;
  const Eigen::Vector3d along = grid.vertices.col(1) - grid.vertices.col(0);
  mesh.vertices.col(vertices) = grid.vertices.col(2) + along;
  mesh.vertices.col(vertices + 1) = grid.vertices.col(3) - along;
  mesh.vertices.col(vertices + 2) << 0, 0, 5;
  mesh.vertices.col(vertices + 3) << 1, 0.5, 5;
  mesh.edges.resize(2, edges + 3);
  mesh.edges.leftCols(edges) = grid.edges;
  mesh.edges.col(edges) << 2, vertices;
  mesh.edges.col(edges + 1) << vertices + 1, 3;
  mesh.edges.col(edges + 2) << vertices + 2, vertices + 3;
  return mesh;
}

}  // namespace limber::rods::testing
