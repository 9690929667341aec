#pragma once

#include <Eigen/Core>

#include "engine/rods/design/surface_mesh.h"

namespace limber::rods::testing {

/// n x n cells of two triangles, whose corners are vertex(i, j), each from 0 to n.
template <class Vertex>
SurfaceMesh cells(int n, const Vertex& vertex) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, Eigen::Index{n + 1} * (n + 1));
  mesh.triangles.resize(3, Eigen::Index{2} * n * n);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.vertices.col(j * (n + 1) + i) = vertex(i, j);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int at = j * (n + 1) + i, up = at + n + 1;
      mesh.triangles.col(2 * (j * n + i)) << at, at + 1, up + 1;
      mesh.triangles.col(2 * (j * n + i) + 1) << at, up + 1, up;
    }
  }
  return mesh;
}

/// n x n cells over a square of side 200, raised by `height` of (x, y) in [-1, 1]^2.
template <class Height>
SurfaceMesh field(int n, const Height& height) {
  return cells(n, [&](int i, int j) {
    const double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
    return Eigen::Vector3d(100 * x, 100 * y, height(x, y));
  });
}

}  // namespace limber::rods::testing
