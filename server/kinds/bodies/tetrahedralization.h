#pragma once

#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// For a surface's mesh: its distance to the surface.
proto::TetrahedralizationReport encode_report(const scene::Tetrahedralization& result);

}  // namespace limber::server
