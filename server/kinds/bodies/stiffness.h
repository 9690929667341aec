#pragma once

#include <string>

#include "server/kinds/bodies/scene.h"

namespace limber::server {

/// Gives the tets of a decoded scene, with mesh and surface already read, the materials that are
/// painted on them.
/// @param field  path of the message, for errors
/// @param read  the bytes of a file of this machine
/// @throws Refusal or Error naming a field below `field`
void paint_stiffness(const proto::PaintedStiffness& message, const std::string& field,
                     const FileReader& read, scene::Scene& scene);

}  // namespace limber::server
