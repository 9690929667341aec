#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/rods/linkage/line_mesh.h"

namespace limber::scene {

/// Reads a line mesh: vertices and `l` elements of a Wavefront .obj. A line through more than two
/// vertices is cut into edges; faces and all other elements are ignored.
/// @throws Error{kInvalidArgument} with the name as field and "name:line: ..." as message, also for
/// a line that uses a missing vertex, faults of edges (rods::fault_of), or a file without lines;
/// {kUnsupported}
[[nodiscard]] rods::LineMesh read_line_mesh(const std::string& name, std::string_view content);
/// @throws Error{kIo} also
[[nodiscard]] rods::LineMesh read_line_mesh_file(const std::filesystem::path& path);

}  // namespace limber::scene
