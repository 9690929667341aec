#pragma once

#include <filesystem>
#include <string>

#include "server/kinds/beams/scene.h"
#include "server/kinds/bodies/scene.h"
#include "server/kinds/linkages/scene.h"

namespace limber::server {

/// Of a scene file: paths are relative to it, and the user may name any file of theirs.
[[nodiscard]] MeshLoader local_loader(const std::filesystem::path& scene_file);
[[nodiscard]] LineLoader local_line_loader(const std::filesystem::path& scene_file);
[[nodiscard]] EdgeLoader local_edge_loader(const std::filesystem::path& scene_file);
[[nodiscard]] MotionReader local_motion_reader(const std::filesystem::path& scene_file);

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
