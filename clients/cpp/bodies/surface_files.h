#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// A surface file's bytes for upload (.obj, .ply, .stl, .off, .glb), with the .mtl files that it
/// names, as far as they are there. @throws ClientError IO naming `field`
[[nodiscard]] v1::MeshFile surface_file(const std::filesystem::path& path,
                                        const std::string& field);

/// The surface in the folder of a mesh: STEM.surface.obj, .ply, .stl, .off or .glb; nothing if
/// there is none.
[[nodiscard]] std::optional<std::filesystem::path> surface_beside(
    const std::filesystem::path& mesh);

/// Puts the bytes of a scene's surface in place of its path, relative to `folder`.
/// @throws ClientError IO naming the field
void put_surface_bytes(v1::Scene& scene, const std::filesystem::path& folder);

/// Writes the surface that a scene brings as bytes below `folder`, and its path into the scene.
/// @throws ClientError IO
void save_surface(v1::Scene& scene, const std::filesystem::path& folder);

}  // namespace limber::client
