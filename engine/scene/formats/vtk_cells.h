#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "engine/scene/formats/mesh_builder.h"

namespace limber::scene::formats {

/// Cells of a VTK unstructured grid as in both its formats. Cell i has type types[i] and the points
/// connectivity[begin .. ends[i]), begin being the end of the previous cell (0 for the first).
struct VtkCells {
  std::vector<std::int64_t> types;
  std::vector<std::int64_t> ends;
  std::vector<std::int64_t> connectivity;
  /// Cell data by their names in lower case, a number for each cell.
  std::map<std::string, std::vector<double>> data;
};

/// Whether cell data of this name are read, as what a material or a group of cells is.
[[nodiscard]] bool is_read_cell_data(const std::string& name);
/// Names of cell data that are not read, for one warning of the file.
void warn_of_cell_data(const std::vector<std::string>& unread, MeshBuilder& builder);

/// Adds the tets (linear, quadratic, Lagrange) with their points shifted by `first_node`, their
/// materials and groups; counts the rest.
/// @throws Error through `file` for ends that run backwards or past the connectivity, or a tet of
/// too few points.
void add_vtk_cells(const VtkCells& cells, std::int64_t first_node, std::int64_t point_count,
                   const TextCursor& file, MeshBuilder& builder);

}  // namespace limber::scene::formats
