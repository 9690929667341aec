#pragma once

#include <map>
#include <string>
#include <vector>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/text_cursor.h"

/// One reader per format. Each takes the whole file; errors are as promised by read_mesh.
namespace limber::scene::formats {

using Companions = std::map<std::string, std::string>;

[[nodiscard]] MeshReading read_abaqus(TextCursor& file);
[[nodiscard]] MeshReading read_gmsh_1(TextCursor& file);
/// MSH 2.x and 4.1, ASCII and binary: reads the header and hands on.
[[nodiscard]] MeshReading read_gmsh(TextCursor& file);
[[nodiscard]] MeshReading read_medit(TextCursor& file);
[[nodiscard]] MeshReading read_tetgen(TextCursor& nodes, TextCursor& elements);
[[nodiscard]] MeshReading read_vega(TextCursor& file, const Companions& companions);
/// Names of the files in *INCLUDE lines, without folders: companions must be in the folder of the
/// file.
[[nodiscard]] std::vector<std::string> vega_includes(std::string_view content);
[[nodiscard]] MeshReading read_vtk_legacy(TextCursor& file);
/// @param array_bytes  see MeshReadLimits
[[nodiscard]] MeshReading read_vtu(const std::string& name, std::string_view content,
                                   std::size_t array_bytes);
/// The points of all pieces, 3 x points, in their order; no cells.
[[nodiscard]] Eigen::Matrix3Xd read_vtu_points(const std::string& name, std::string_view content,
                                               std::size_t array_bytes);

}  // namespace limber::scene::formats
