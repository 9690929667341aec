#pragma once

#include "engine/scene/tetrahedralize/tetrahedralize.h"

namespace limber::scene::lattice {

/// Tets between the lattice points inside of a body and its surface; may still be in several pieces
/// and touch itself.
struct Stuffing {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<Eigen::Vector4i> tets;  // positively oriented
};

[[nodiscard]] bodies::TetMesh as_mesh(const Stuffing& stuffing);

/// One pass of isosurface stuffing with lattice cells of side `cell`. Deterministic.
/// @param phase  position of the lattice: its middle is shifted from the middle of the box by this
/// many cells. Zero gives
///   bodies that are symmetric to the middle planes of their box nearly symmetric meshes.
[[nodiscard]] Stuffing stuff(const ImplicitSolid& solid, double cell, const Eigen::Vector3d& phase,
                             int max_lattice_points, const JobContext& job);

/// Lattice points that stuff() will look at.
[[nodiscard]] double lattice_points(const ImplicitSolid& solid, double cell);

}  // namespace limber::scene::lattice
