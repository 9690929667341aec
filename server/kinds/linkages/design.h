#pragma once

#include <functional>
#include <memory>
#include <string>

#include "engine/scene/triangle_surface.h"
#include "engine/session/linkages/design_values.h"
#include "limber/v1/design.pb.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// Reads the file of this machine that a path names. `field` is the path's, for errors.
using SurfaceLoader =
    std::function<scene::TriangleSurface(const std::string& path, const std::string& field)>;

/// @throws Refusal or Error with a path below the request; numbers are the engine's to refuse
[[nodiscard]] session::DesignRequest decode_design(const proto::StartDesignRequest& request,
                                                   const SurfaceLoader& load);
[[nodiscard]] session::DesignChange decode_design_change(const proto::ChangeDesignRequest& request,
                                                         const SurfaceLoader& load);

/// A grid of rods for a surface. @throws Refusal or Error with a path below the request
[[nodiscard]] proto::MakeStartingGridResponse make_starting_grid(
    const proto::MakeStartingGridRequest& request, const SurfaceLoader& load);

/// @param length_unit  metres per scene unit: energies of the engine are in N times that unit, on
/// the wire in J
[[nodiscard]] proto::DesignInfo encode_design(const session::DesignInfo& info, double length_unit);

}  // namespace limber::server
