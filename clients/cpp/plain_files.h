#pragma once

#include <filesystem>

namespace limber::client {

/// Kind of a file to be opened, by its ending, and for an .obj by its content.
enum class FileKind {
  kScene,      // JSON, a job of the public relaxation code, or unknown
  kTets,       // a tetrahedral mesh
  kTriangles,  // a surface, to be filled with tets
  kLines,      // of a rod linkage
};

/// @throws ClientError IO
[[nodiscard]] FileKind kind_of_file(const std::filesystem::path& path);

}  // namespace limber::client
