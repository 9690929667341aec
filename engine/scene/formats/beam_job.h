#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/scene/beams.h"

namespace limber::scene {

/// Reads SimulationJob.json and, where `settings` is not empty, the initial distortion of
/// DRMSettings.json. Unknown keys of jobs are refused; the message names the nearest known key. In
/// the settings, keys that are almost "initialDistortion" are refused and all others are ignored.
/// @throws Error{kInvalidArgument} with the member as field, e.g. "forces[3]"
[[nodiscard]] BeamJob read_beam_job(std::string_view job, std::string_view settings = {});

/// Both files of a folder, and the mesh that the job names.
struct BeamJobFiles {
  BeamJob job;
  EdgeMesh mesh;
};
/// @throws Error as read_beam_job and read_edge_mesh, {kIo}
[[nodiscard]] BeamJobFiles read_beam_job_folder(const std::filesystem::path& folder);

}  // namespace limber::scene
