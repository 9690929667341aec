#pragma once

#include <string>

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// @param known_basis_hash  the basis is left out where the client has it already
[[nodiscard]] proto::GetGeometryResponse encode_geometry(const session::Geometry& geometry,
                                                         const std::string& known_basis_hash);

}  // namespace limber::server
