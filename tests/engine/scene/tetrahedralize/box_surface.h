#pragma once

#include <Eigen/Core>

#include "engine/scene/formats/surface_formats.h"

namespace limber::scene::testing {

/// An axis-aligned box as twelve triangles.
inline TriangleSurface box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TriangleSurface surface =
      read_surface("cube.obj",
                   "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                   "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  surface.vertices = ((high - low).asDiagonal() * surface.vertices).colwise() + low;
  return surface;
}

}  // namespace limber::scene::testing
