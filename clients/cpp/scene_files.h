#pragma once

#include <filesystem>
#include <string>

#include "clients/cpp/files.h"

namespace limber::client {

/// The file that defines the scene: that of a job of beams in its folder, else the path itself.
[[nodiscard]] std::filesystem::path file_of_scene(const std::filesystem::path& path);

/// Reads a scene file of any kind (the JSON form of v1::Scene, or a job of beams). Paths of the
/// mesh, of the base motion and of keyframes' poses, which are relative to the scene file, are
/// replaced by the bytes of the files.
/// @throws ClientError IO, INVALID_ARGUMENT
[[nodiscard]] v1::Scene load_scene(const std::filesystem::path& path);

/// Writes the scene to a folder: FOLDER/NAME.json, and with it the mesh if the message has its
/// bytes or arrays (as Gmsh MSH 2.2). @returns the scene file @throws ClientError IO
std::filesystem::path save_scene(v1::Scene scene, const std::string& name,
                                 const std::filesystem::path& folder);

}  // namespace limber::client
