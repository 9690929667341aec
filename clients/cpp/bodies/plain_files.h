#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// Frames of bodies that are opened without a scene file.
inline constexpr unsigned kFramesOfPlainFiles = 120;

/// An elastic body of a tetrahedral mesh, with the server's defaults: 120 frames, nothing fixed.
/// @throws ClientError IO
[[nodiscard]] v1::Scene scene_of_tets(const std::filesystem::path& path);
/// The same of tets that are not in a file. @param name  of the scene
[[nodiscard]] v1::Scene scene_of_tets(const std::string& name, v1::MeshArrays mesh);

/// Properties of such a scene that its file does not define, in words. @param scene  as the server
/// has it: with its defaults
[[nodiscard]] std::string body_assumptions(const v1::Scene& scene);

}  // namespace limber::client
