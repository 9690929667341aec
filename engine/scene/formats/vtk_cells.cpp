#include "engine/scene/formats/vtk_cells.h"

namespace limber::scene::formats {
namespace {

const char* cell_name(std::int64_t type) {
  switch (type) {
    case 1:
    case 2:
      return "points";
    case 3:
    case 4:
    case 21:
    case 35:
    case 68:
      return "lines";
    case 5:
    case 6:
    case 22:
    case 34:
    case 69:
      return "triangles";
    case 7:
      return "polygons";
    case 8:
    case 9:
    case 23:
    case 28:
    case 70:
      return "quadrangles";
    case 11:
    case 12:
    case 25:
    case 29:
    case 33:
    case 72:
      return "hexahedra";
    case 13:
    case 26:
    case 32:
    case 73:
      return "prisms";
    case 14:
    case 27:
    case 74:
      return "pyramids";
    case 42:
      return "polyhedra";
    default:
      return "cells of other types";
  }
}

}  // namespace

void add_vtk_cells(const VtkCells& cells, std::int64_t first_node, std::int64_t point_count,
                   const TextCursor& file, MeshBuilder& builder) {
  constexpr std::int64_t kTet = 10;
  constexpr std::int64_t kQuadraticTet = 24;
  constexpr std::int64_t kLagrangeTet = 71;
  constexpr std::int64_t kBezierTet = 78;
  std::int64_t begin = 0;
  for (std::size_t i = 0; i < cells.types.size(); ++i) {
    const std::int64_t end = cells.ends[i];
    if (end < begin || end > static_cast<std::int64_t>(cells.connectivity.size())) {
      file.fail("cell " + std::to_string(i) + " (from 0) ends at " + std::to_string(end) +
                ", outside of the connectivity");
    }
    const std::int64_t type = cells.types[i];
    if (type != kTet && type != kQuadraticTet && type != kLagrangeTet && type != kBezierTet) {
      builder.ignore_cell(cell_name(type));
    } else {
      if (end - begin < 4 || (type == kTet && end - begin != 4)) {
        file.fail("cell " + std::to_string(i) + " (from 0) is a tetrahedron of " +
                  std::to_string(end - begin) + " points");
      }
      std::array<std::int64_t, 4> nodes{};
      for (std::size_t corner = 0; corner < 4; ++corner) {
        const std::int64_t point = cells.connectivity[static_cast<std::size_t>(begin) + corner];
        if (point < 0 || point >= point_count) {
          file.fail("cell " + std::to_string(i) + " (from 0) uses point " + std::to_string(point) +
                    " of " + std::to_string(point_count));
        }
        nodes[corner] = point + first_node;
      }
      builder.add_tet(static_cast<std::int64_t>(i), nodes, file.line());
      if (type != kTet) builder.count_curved_tet();
    }
    begin = end;
  }
}

}  // namespace limber::scene::formats
