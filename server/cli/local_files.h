#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"
#include "server/wire/paths.h"

namespace limber::server {

namespace proto = limber::v1;

/// Of a scene file: paths are relative to it, and the user may name any file of theirs.
[[nodiscard]] PathResolver paths_beside(const std::filesystem::path& scene_file);

/// A job of the public relaxation code: its folder, or its SimulationJob.json.
[[nodiscard]] bool is_local_beam_job(const std::filesystem::path& path);
/// The scene of such a job, with the files that it names from beside it; what is wrong in them is
/// found where the scene is decoded. @throws Error{kIo} naming a file that is missing
[[nodiscard]] proto::Scene local_beam_job(const std::filesystem::path& path);

enum class WriteMode { kReplace, kAppend };
/// @throws Error{kIo} naming the path
void write_file(const std::filesystem::path& path, const std::string& content,
                WriteMode mode = WriteMode::kReplace);

}  // namespace limber::server
