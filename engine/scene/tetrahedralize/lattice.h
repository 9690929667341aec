#pragma once

#include "engine/scene/tetrahedralize.h"

namespace limber::scene::lattice {

/// Tets between the lattice points inside of a body and its surface; may still be in several pieces
/// and touch itself.
struct Stuffing {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<Eigen::Vector4i> tets;  // positively oriented
};

/// One pass of isosurface stuffing with lattice cells of side `cell`. Deterministic; the lattice is
/// centred on the box, so that bodies symmetric to its middle planes give nearly symmetric meshes.
[[nodiscard]] Stuffing stuff(const ImplicitSolid& solid, double cell, int max_lattice_points,
                             const JobContext& job);

}  // namespace limber::scene::lattice
