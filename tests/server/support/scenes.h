#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"

namespace limber::server::testing {

namespace proto = limber::v1;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// A bar of `cells` x 1 x 1 unit cells of six tets along x, its end at x = 0 fixed.
struct Bar {
  std::vector<double> nodes;
  std::vector<std::int32_t> tets;
  std::vector<std::uint32_t> fixed;
  int node_count = 0, tet_count = 0;
};

inline Bar make_bar(int cells) {
  Bar bar;
  const auto id = [](int x, int y, int z) { return 4 * x + 2 * y + z; };
  for (int x = 0; x <= cells; ++x) {
    for (int y = 0; y < 2; ++y) {
      for (int z = 0; z < 2; ++z) {
        bar.nodes.insert(bar.nodes.end(), {0.25 * x, 0.25 * y, 0.25 * z});
        if (x == 0) bar.fixed.push_back(static_cast<std::uint32_t>(id(x, y, z)));
      }
    }
  }
  // Six tets around the diagonal from corner 0 to corner 7 (corner = 4 x + 2 y + z).
  constexpr int kTets[6][4] = {{0, 4, 6, 7}, {0, 6, 2, 7}, {0, 2, 3, 7},
                               {0, 3, 1, 7}, {0, 1, 5, 7}, {0, 5, 4, 7}};
  for (int x = 0; x < cells; ++x) {
    for (const auto& tet : kTets) {
      for (const int c : tet) bar.tets.push_back(id(x + (c >> 2), (c >> 1) & 1, c & 1));
    }
  }
  bar.node_count = 4 * (cells + 1);
  bar.tet_count = 6 * cells;
  return bar;
}

inline proto::MeshArrays mesh_of(const Bar& bar) {
  proto::MeshArrays mesh;
  mesh.mutable_nodes()->set_type(proto::DATA_TYPE_FLOAT64);
  mesh.mutable_nodes()->add_shape(static_cast<std::uint64_t>(bar.node_count));
  mesh.mutable_nodes()->add_shape(3);
  mesh.mutable_nodes()->set_data(bytes_of(bar.nodes));
  mesh.mutable_tets()->set_type(proto::DATA_TYPE_INT32);
  mesh.mutable_tets()->add_shape(static_cast<std::uint64_t>(bar.tet_count));
  mesh.mutable_tets()->add_shape(4);
  mesh.mutable_tets()->set_data(bytes_of(bar.tets));
  return mesh;
}

/// A scene that is built and solved in a moment: a short bar, few modes, its far end pulled up in
/// the middle frame.
inline proto::Scene small_scene(int cells = 6, std::uint32_t frames = 20) {
  const Bar bar = make_bar(cells);
  proto::Scene scene;
  scene.set_name("bar");
  *scene.mutable_mesh()->mutable_arrays() = mesh_of(bar);
  for (const auto node : bar.fixed) scene.add_fixed_nodes(node);
  scene.set_frames(frames);
  scene.mutable_model()->set_modes(4);
  scene.mutable_model()->set_basis_size(8);
  scene.mutable_model()->set_cubature_size(8);
  auto* constraint = scene.add_constraints();
  constraint->set_id(1);
  constraint->set_frame(frames / 2);
  constraint->add_nodes(static_cast<std::uint32_t>(bar.node_count - 1));
  constraint->mutable_displacement()->set_y(0.1);
  return scene;
}

}  // namespace limber::server::testing
