#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/formats/mesh_builder.h"

namespace limber::scene::formats {

/// Cells of a VTK unstructured grid as both its formats give them: cell i has type types[i] and the
/// points connectivity[begin .. ends[i]), begin being the end of the cell before (0 for the first).
struct VtkCells {
  std::vector<std::int64_t> types;
  std::vector<std::int64_t> ends;
  std::vector<std::int64_t> connectivity;
};

/// Adds the tets (linear, quadratic, Lagrange) with their points shifted by `first_node`; counts
/// the rest.
/// @throws Error through `file` for ends that run backwards or past the connectivity, or a tet of
/// too few points.
void add_vtk_cells(const VtkCells& cells, std::int64_t first_node, std::int64_t point_count,
                   const TextCursor& file, MeshBuilder& builder);

}  // namespace limber::scene::formats
