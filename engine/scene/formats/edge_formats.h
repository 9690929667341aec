#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/scene/beams.h"

namespace limber::scene {

/// Reads the edges of a Stanford .ply (element `edge` with vertex1 and vertex2, normals nx, ny, nz)
/// or the `l` elements of a Wavefront .obj. Lines through more vertices are cut into edges. Faces
/// and all other elements are ignored.
/// @throws Error{kInvalidArgument} with the name as field and "name:line: ..." as message, also for
/// an edge that uses a missing vertex, or a file without edges; {kUnsupported}
[[nodiscard]] EdgeMesh read_edge_mesh(const std::string& name, std::string_view content);
/// @throws Error{kIo} also
[[nodiscard]] EdgeMesh read_edge_mesh_file(const std::filesystem::path& path);

}  // namespace limber::scene
