#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"
#include "limber/v1/service.pb.h"

namespace limber::client {

/// A mesh file's bytes for upload, with what belongs to it: TetGen's other half, VegaFEM's
/// includes, and materials in a file of the same stem ending in .elastic.
/// @throws ClientError IO naming `field`
[[nodiscard]] v1::MeshFile mesh_file(const std::filesystem::path& path,
                                     const std::string& field = "mesh.path");

/// Reads a scene file (the JSON form of v1::Scene; or of a structure of beams alone) and puts the
/// bytes of the mesh, of the base motion and of keyframes' poses in place of their paths, which are
/// relative to the scene file.
/// @throws ClientError IO, INVALID_ARGUMENT
[[nodiscard]] v1::Scene load_scene(const std::filesystem::path& path);

/// The scene as a file in a folder: FOLDER/NAME.json, and beside it the mesh where the message
/// brings its bytes or arrays (as Gmsh MSH 2.2). @returns the scene file @throws ClientError IO
std::filesystem::path save_scene(v1::Scene scene, const std::string& name,
                                 const std::filesystem::path& folder);

/// Writes one file of an export below the folder, whatever its name claims. @throws ClientError
/// MALFORMED, IO
std::filesystem::path write_exported(const std::filesystem::path& folder,
                                     const v1::ExportedFile& file);

[[nodiscard]] std::string read_bytes(const std::filesystem::path& path, const std::string& field);

enum class WriteMode { kReplace, kAppend };
void write_bytes(const std::filesystem::path& path, const std::string& bytes,
                 WriteMode mode = WriteMode::kReplace);

}  // namespace limber::client
