#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// Puts the bytes of a scene's mesh file in place of its path, relative to `folder`.
/// @throws ClientError IO naming the field
void put_mesh_bytes(v1::Scene& scene, const std::filesystem::path& folder);
/// The same of keyframes' poses and of the base motion. @throws ClientError IO, INVALID_ARGUMENT
void put_pose_bytes(v1::Scene& scene, const std::filesystem::path& folder);

/// A file of numbers that a scene's body is painted with, for upload: a text, a .ply or JSON, as
/// PaintedStiffness.file says. @throws ClientError IO naming `field`
[[nodiscard]] v1::PaintedStiffness painted_stiffness(
    const std::filesystem::path& path, const std::string& field = "painted_stiffness.path");
/// Puts such bytes in place of a scene's path. @throws ClientError IO
void put_stiffness_bytes(v1::Scene& scene, const std::filesystem::path& folder);

/// Writes the mesh of a scene (bytes, or arrays as Gmsh MSH 2.2) below `folder`, and its path into
/// the scene. @param name  of a file for arrays, without its ending @throws ClientError IO
void save_mesh(v1::Scene& scene, const std::string& name, const std::filesystem::path& folder);

}  // namespace limber::client
