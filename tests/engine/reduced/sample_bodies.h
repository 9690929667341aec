#pragma once

#include <Eigen/LU>
#include <array>
#include <utility>

#include "engine/bodies/elastic_body.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced::testing {

/// A block of nx x ny x nz cells of `cell` metres, six tets each; nodes with x = 0 fixed, or none.
inline bodies::ElasticBody block(int nx, int ny, int nz, double cell, bool fixed_end) {
  bodies::ElasticBody body;
  const auto id = [&](int i, int j, int k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  body.mesh.nodes.resize(3, (nx + 1) * (ny + 1) * (nz + 1));
  for (int i = 0; i <= nx; ++i) {
    for (int j = 0; j <= ny; ++j) {
      for (int k = 0; k <= nz; ++k) {
        body.mesh.nodes.col(id(i, j, k)) = cell * Eigen::Vector3d(i, j, k);
        if (fixed_end && i == 0) body.fixed_nodes.push_back(id(i, j, k));
      }
    }
  }
  // Six paths from corner (0,0,0) to (1,1,1), one axis at a time.
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  body.mesh.tets.resize(4, 6 * nx * ny * nz);
  int e = 0;
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      for (int k = 0; k < nz; ++k) {
        for (const auto& path : kPaths) {
          std::array<int, 3> at = {i, j, k};
          Eigen::Vector4i tet;
          tet[0] = id(at[0], at[1], at[2]);
          for (int step = 0; step < 3; ++step) {
            ++at[path[step]];
            tet[step + 1] = id(at[0], at[1], at[2]);
          }
          Eigen::Matrix3d edges;
          for (int a = 0; a < 3; ++a)
            edges.col(a) = body.mesh.nodes.col(tet[a + 1]) - body.mesh.nodes.col(tet[0]);
          if (edges.determinant() < 0) std::swap(tet[2], tet[3]);
          body.mesh.tets.col(e++) = tet;
        }
      }
    }
  }
  body.mesh.materials = {{1e6, 0.4, 1000}};
  body.mesh.tet_material.assign(static_cast<std::size_t>(e), 0);
  return body;
}

/// The first eight.
inline ScaledModes modes_of(const bodies::ElasticBody& body) {
  return scale_modes(body, bodies::modal_analysis(body, {.mode_count = 8}));
}

}  // namespace limber::reduced::testing
