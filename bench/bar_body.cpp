#include "bench/bar_body.h"

#include <array>
#include <utility>

#include "engine/bodies/mesh_validation.h"

namespace limber::bench {

bodies::ElasticBody bar_body(int cells) {
  const std::array<int, 3> count{3 * cells, cells, cells};
  const double side = 1.0 / cells;
  bodies::TetMesh mesh;
  const auto node = [&](int x, int y, int z) {
    return (x * (count[1] + 1) + y) * (count[2] + 1) + z;
  };
  mesh.nodes.resize(3, (count[0] + 1) * (count[1] + 1) * (count[2] + 1));
  std::vector<int> held;
  for (int x = 0; x <= count[0]; ++x) {
    for (int y = 0; y <= count[1]; ++y) {
      for (int z = 0; z <= count[2]; ++z) {
        mesh.nodes.col(node(x, y, z)) = side * Eigen::Vector3d(x, y, z);
        if (x == 0) held.push_back(node(x, y, z));
      }
    }
  }
  // Corner b of a cube is at (b & 1, b >> 1 & 1, b >> 2); the diagonal goes from 0 to 7.
  constexpr std::array<std::pair<int, int>, 6> kAround{
      {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}};
  mesh.tets.resize(4, 6 * count[0] * count[1] * count[2]);
  int tet = 0;
  for (int x = 0; x < count[0]; ++x) {
    for (int y = 0; y < count[1]; ++y) {
      for (int z = 0; z < count[2]; ++z) {
        const auto corner = [&](int b) {
          return node(x + (b & 1), y + (b >> 1 & 1), z + (b >> 2));
        };
        for (const auto& [a, b] : kAround)
          mesh.tets.col(tet++) << corner(0), corner(a), corner(b), corner(7);
      }
    }
  }
  bodies::PreparedMesh prepared = bodies::prepare_mesh(mesh, held);
  bodies::ElasticBody body;
  body.mesh = std::move(prepared.mesh);
  body.mesh.materials = {bodies::Material{}};
  body.mesh.tet_material.assign(static_cast<std::size_t>(body.mesh.tet_count()), 0);
  for (const int source : held)
    body.fixed_nodes.push_back(prepared.compact_of_source[static_cast<std::size_t>(source)]);
  return body;
}

}  // namespace limber::bench
