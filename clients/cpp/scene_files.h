#pragma once

#include <filesystem>
#include <string>

#include "clients/cpp/files.h"

namespace limber::client {

/// The file that says what is opened: that of a job of beams in its folder, else the path itself.
[[nodiscard]] std::filesystem::path file_of_scene(const std::filesystem::path& path);

/// Reads a scene file of any kind (the JSON form of v1::Scene, or a job of beams) and puts the
/// bytes of the mesh, of the base motion and of keyframes' poses in place of their paths, which are
/// relative to the scene file.
/// @throws ClientError IO, INVALID_ARGUMENT
[[nodiscard]] v1::Scene load_scene(const std::filesystem::path& path);

/// The scene as a file in a folder: FOLDER/NAME.json, and beside it the mesh where the message
/// brings its bytes or arrays (as Gmsh MSH 2.2). @returns the scene file @throws ClientError IO
std::filesystem::path save_scene(v1::Scene scene, const std::string& name,
                                 const std::filesystem::path& folder);

}  // namespace limber::client
