#pragma once

#include "engine/scene/formats/mesh_formats.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/paths.h"

namespace limber::server {

/// Reads what scenes name as paths, as bytes, or as samples.
/// @param resolve  the file of this machine that a path means, or throws naming the field
[[nodiscard]] SceneReaders scene_readers(const PathResolver& resolve,
                                         scene::MeshReadLimits limits = {});

/// Files that a scene names, read as they are. @throws Refusal or Error naming `field` + ".path" or
/// ".file"
[[nodiscard]] SurfaceReader surface_reader(PathResolver resolve);

}  // namespace limber::server
