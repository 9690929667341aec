#pragma once

#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// Of a surface's mesh: how near it is to the surface.
proto::TetrahedralizationReport encode_report(const scene::Tetrahedralization& result);

}  // namespace limber::server
