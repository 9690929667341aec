#pragma once

#include <filesystem>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// A job of the public relaxation code: its folder, or its SimulationJob.json?
[[nodiscard]] bool is_beam_job(const std::filesystem::path& path);
/// Its SimulationJob.json. @param path  that, or its folder
[[nodiscard]] std::filesystem::path file_of_beam_job(const std::filesystem::path& path);

/// A structure of beams (.json), that of a scene file, or a job with the files that it names.
/// @throws ClientError INVALID_ARGUMENT with a path below `structure`, IO
[[nodiscard]] v1::BeamScene load_beams(const std::filesystem::path& path);

/// Puts the bytes of a structure's file of lines in place of its path, relative to `folder`.
/// @throws ClientError IO naming the field
void put_beam_bytes(v1::Scene& scene, const std::filesystem::path& folder);

}  // namespace limber::client
