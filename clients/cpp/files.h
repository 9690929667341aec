#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"
#include "limber/v1/service.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

[[nodiscard]] std::string read_bytes(const std::filesystem::path& path, const std::string& field);

enum class WriteMode { kReplace, kAppend };
void write_bytes(const std::filesystem::path& path, const std::string& bytes,
                 WriteMode mode = WriteMode::kReplace);

/// Ending of a file's name, with its dot, in lower case.
[[nodiscard]] std::string lower_ending(const std::filesystem::path& path);

/// A mesh file's bytes for upload, with what belongs to it: TetGen's other half, VegaFEM's
/// includes, and materials in a file of the same stem ending in .elastic.
/// @throws ClientError IO naming `field`
[[nodiscard]] v1::MeshFile mesh_file(const std::filesystem::path& path,
                                     const std::string& field = "mesh.path");

/// Writes one file of an export below the folder, for every name that it has. @throws ClientError
/// MALFORMED, IO
std::filesystem::path write_exported(const std::filesystem::path& folder,
                                     const v1::ExportedFile& file);

}  // namespace limber::client
