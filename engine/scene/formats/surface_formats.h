#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/triangle_surface.h"

namespace limber::scene {

/// Reads a triangle surface: Wavefront .obj (polygons are fanned; texture and normal indices are
/// passed over), .ply (ASCII and binary of either byte order), .stl (ASCII and binary; equal
/// vertices are merged, since the format repeats them). Vertices that coincide exactly are merged
/// in .stl only.
/// @throws Error{kInvalidArgument} with the name as field and "name:line: ..." as message;
/// {kUnsupported}
[[nodiscard]] TriangleSurface read_surface(const std::string& name, std::string_view content);
/// @throws Error{kIo} also
[[nodiscard]] TriangleSurface read_surface_file(const std::filesystem::path& path);

/// With its dot, in lower case.
[[nodiscard]] std::string surface_ending(const std::string& name);

/// Material files that the lines "mtllib NAME" of an .obj name, without folders; .mtl files alone.
[[nodiscard]] std::vector<std::string> material_libraries(std::string_view obj);

/// Wavefront .obj text of a surface, vertices in their order (so that a .pc2 of the same nodes
/// fits), numbers that read back to the same float64.
[[nodiscard]] std::string write_obj(const Eigen::Matrix3Xd& vertices,
                                    const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles);

}  // namespace limber::scene
