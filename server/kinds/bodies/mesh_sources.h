#pragma once

#include <filesystem>
#include <string>

#include "engine/scene/formats/mesh_formats.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/paths.h"

namespace limber::server {

/// Loads meshes that come as a path, a file or a sample.
/// @param resolve  the file of this machine that a path means, or throws naming the field. The
/// loader throws Refusal or Error naming `field` + ".path", ...
[[nodiscard]] MeshLoader mesh_loader(PathResolver resolve, scene::MeshReadLimits limits = {});

/// The bytes of a file of this machine. @throws Error naming `field`
[[nodiscard]] std::string read_file_at(const std::filesystem::path& file, const std::string& field);

/// An uploaded file with its companions.
[[nodiscard]] scene::MeshFileSet file_set(const proto::MeshFile& file);

}  // namespace limber::server
