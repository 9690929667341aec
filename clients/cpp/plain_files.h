#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

/// Of bodies that are opened without a scene file.
inline constexpr unsigned kFramesOfPlainFiles = 120;

/// What a file that is to be opened is, by its ending, and of an .obj by what is in it.
enum class FileKind {
  kScene,      // JSON, a job of the public relaxation code, or unknown
  kTets,       // a tetrahedral mesh
  kTriangles,  // a surface, to be filled with tets
  kLines,      // of a rod linkage
};

/// @throws ClientError IO
[[nodiscard]] FileKind kind_of_file(const std::filesystem::path& path);

/// An elastic body of a tetrahedral mesh, with the server's defaults: 120 frames, nothing fixed.
/// @throws ClientError IO
[[nodiscard]] v1::Scene scene_of_tets(const std::filesystem::path& path);

/// A rod linkage of the lines of an .obj. Its rods are laths: a tenth of the median line wide, a
/// twentieth high; material and all else by the server's defaults.
/// @throws ClientError IO, INVALID_ARGUMENT naming `scene` where there is no line of some length
[[nodiscard]] v1::Scene scene_of_lines(const std::filesystem::path& path);

/// What a scene of one of these has that its file does not say, in words.
/// @param scene  as the server has it: with its defaults
[[nodiscard]] std::string assumed(const v1::Scene& scene);

}  // namespace limber::client
