#pragma once

#include <algorithm>
#include <array>

#include "engine/base/random.h"
#include "engine/bodies/elastic_body.h"

namespace limber::bodies::testing {

/// A box of cells, each cut into six tets around its main diagonal (Kuhn), all positively oriented.
inline TetMesh box_mesh(std::array<int, 3> cells, Eigen::Vector3d size, Material material = {}) {
  const auto [cx, cy, cz] = cells;
  const auto node = [&, nx = cx + 1, ny = cy + 1](int i, int j, int k) {
    return (k * ny + j) * nx + i;
  };
  TetMesh mesh;
  mesh.nodes.resize(3, (cx + 1) * (cy + 1) * (cz + 1));
  for (int k = 0; k <= cz; ++k) {
    for (int j = 0; j <= cy; ++j) {
      for (int i = 0; i <= cx; ++i) {
        mesh.nodes.col(node(i, j, k)) =
            Eigen::Vector3d(size.x() * i / cx, size.y() * j / cy, size.z() * k / cz);
      }
    }
  }
  mesh.tets.resize(4, 6 * cx * cy * cz);
  int filled = 0;
  for (int k = 0; k < cz; ++k) {
    for (int j = 0; j < cy; ++j) {
      for (int i = 0; i < cx; ++i) {
        std::array<int, 3> order = {0, 1, 2};
        do {
          std::array<int, 3> at = {i, j, k};
          Eigen::Vector4i tet;
          tet[0] = node(at[0], at[1], at[2]);
          for (int step = 0; step < 3; ++step) {
            ++at[order[step]];
            tet[step + 1] = node(at[0], at[1], at[2]);
          }
          const bool odd = (order[0] > order[1]) ^ (order[0] > order[2]) ^ (order[1] > order[2]);
          if (odd) std::swap(tet[2], tet[3]);
          mesh.tets.col(filled++) = tet;
        } while (std::next_permutation(order.begin(), order.end()));
      }
    }
  }
  mesh.materials = {material};
  mesh.tet_material.assign(static_cast<std::size_t>(mesh.tet_count()), 0);
  return mesh;
}

/// Moves inner nodes by up to `amount` per axis; the sides stay flat.
inline TetMesh jitter(TetMesh mesh, double amount, std::uint64_t seed = 11) {
  Random random(seed);
  const Eigen::Vector3d low = mesh.nodes.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.nodes.rowwise().maxCoeff();
  for (int a = 0; a < mesh.node_count(); ++a) {
    auto node = mesh.nodes.col(a);
    const bool inside = (node.array() > low.array()).all() && (node.array() < high.array()).all();
    for (int axis = 0; axis < 3; ++axis) {
      const double move = random.uniform(-amount, amount);
      if (inside) node[axis] += move;
    }
  }
  return mesh;
}

/// A box held at its face x = 0, or free.
enum class Hold { kFree, kLeftFace };

inline ElasticBody box_body(std::array<int, 3> cells, Eigen::Vector3d size, Hold hold,
                            Material material = {}) {
  ElasticBody body{box_mesh(cells, size, material), {}};
  if (hold == Hold::kLeftFace) {
    for (int a = 0; a < body.mesh.node_count(); ++a) {
      if (body.mesh.nodes(0, a) == 0) body.fixed_nodes.push_back(a);
    }
  }
  return body;
}

/// 60 x 10 x 10 cm, of rubber unless given.
inline ElasticBody slender_beam(Hold hold, Material material = {2e5, 0.4, 1000}) {
  return box_body({6, 2, 2}, {0.6, 0.1, 0.1}, hold, material);
}

}  // namespace limber::bodies::testing
