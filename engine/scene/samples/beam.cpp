#include <cmath>

#include "engine/scene/samples/sample_parts.h"

namespace limber::scene::samples {
namespace {

/// The paper's beam: 16 x 8 x 8 cells over its bounding box, each cut into six tets around the same
/// diagonal (Kuhn), so that neighbouring cells fit.
bodies::TetMesh beam_mesh(int nx, int ny, int nz, const Eigen::Vector3d& low,
                          const Eigen::Vector3d& high) {
  bodies::TetMesh mesh;
  const auto node = [&](int i, int j, int k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  mesh.nodes.resize(3, (nx + 1) * (ny + 1) * (nz + 1));
  for (int i = 0; i <= nx; ++i) {
    for (int j = 0; j <= ny; ++j) {
      for (int k = 0; k <= nz; ++k) {
        const Eigen::Vector3d at(static_cast<double>(i) / nx, static_cast<double>(j) / ny,
                                 static_cast<double>(k) / nz);
        mesh.nodes.col(node(i, j, k)) = low + at.cwiseProduct(high - low);
      }
    }
  }
  // The orders in which the three axes can be followed from one corner of a cell to the opposite
  // one. The last number is 1 for an odd permutation, which would turn the tet inside out.
  static constexpr int kWalks[6][4] = {{0, 1, 2, 0}, {1, 2, 0, 0}, {2, 0, 1, 0},
                                       {0, 2, 1, 1}, {2, 1, 0, 1}, {1, 0, 2, 1}};
  mesh.tets.resize(4, 6 * nx * ny * nz);
  int tet = 0;
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      for (int k = 0; k < nz; ++k) {
        for (const auto& walk : kWalks) {
          int at[3] = {i, j, k};
          int corners[4] = {node(i, j, k), 0, 0, 0};
          for (int step = 0; step < 3; ++step) {
            ++at[walk[step]];
            corners[step + 1] = node(at[0], at[1], at[2]);
          }
          if (walk[3]) std::swap(corners[2], corners[3]);
          mesh.tets.col(tet++) << corners[0], corners[1], corners[2], corners[3];
        }
      }
    }
  }
  return mesh;
}

}  // namespace

Scene make_beam() {
  Scene scene;
  scene.name = "beam";
  const Eigen::Vector3d high(0.5, 0.5 / 13, 0.0897440);
  scene.mesh = beam_mesh(16, 8, 8, -high, high);
  scene.material = {2e5, 0.45, 100};
  // The first layer of cells, as in the paper's data: 162 nodes.
  fix_where(scene, [&](const Eigen::Vector3d& x) { return x[0] < -high[0] + 1.5 / 16; });
  scene.frame_count = 150;
  scene.dynamics.period_frames = 40;
  scene.model.mode_count = 30;
  const int tip = node_near(scene.mesh, {high[0], 0, 0});
  // Tip positions of a bar bent to circular arcs: what a bar of this length can do without being
  // stretched.
  const double length = 2 * high[0] - 1.0 / 16;
  const auto arc = [&](double angle, const Eigen::Vector3d& side) -> Eigen::Vector3d {
    return length * (std::sin(angle) / angle - 1) * Eigen::Vector3d::UnitX() +
           length * (1 - std::cos(angle)) / angle * side;
  };
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d slanted = Eigen::Vector3d(0, -1, 0.35).normalized();
  add_target(scene, 30, tip, arc(0.9, up));
  add_target(scene, 60, tip, arc(1.1, slanted));
  add_target(scene, 90, tip, arc(0.7, up));
  add_target(scene, 115, tip, arc(0.4, -up));
  return scene;
}

}  // namespace limber::scene::samples
