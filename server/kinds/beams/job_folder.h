#pragma once

#include <filesystem>

#include "limber/v1/scene.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// A job of the public relaxation code: its folder, or its SimulationJob.json.
[[nodiscard]] bool is_beam_job_folder(const std::filesystem::path& path);
/// The scene of such a job, with the files that it names from the same folder. Errors in them are
/// found when the scene is decoded. @throws Error{kIo} naming a file that is missing
[[nodiscard]] proto::Scene beam_job_scene(const std::filesystem::path& path);

}  // namespace limber::server
