#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/triangle_surface.h"

namespace limber::scene {

/// The formats that read_surface() knows, for messages.
inline constexpr const char* kSurfaceEndings = ".obj, .ply, .stl, .off and .glb";

/// Reads a triangle surface: .obj, .ply (ASCII and binary of either byte order), .stl (ASCII and
/// binary), .off (text) and .glb (binary glTF 2.0). Polygons of Wavefront .obj are fanned, its
/// texture and normal indices ignored; colours and normals of .off are ignored. For .glb these are
/// the triangles of its default scene, moved by their nodes; no skins, morph targets or materials.
/// Vertices that coincide exactly are merged in .stl and .glb only, since these formats repeat
/// them; they are numbered in the order of the triangles then. Coordinates stay as in the file,
/// whatever unit and axes it is in: those of .glb are metres with y up by its standard.
///
/// These readers are small and our own: files come from strangers, and general import libraries
/// (Assimp) have a long history of memory faults with such files.
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
