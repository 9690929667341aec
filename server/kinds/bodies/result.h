#pragma once

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// @param length_unit  metres per scene unit: the engine reports errors in metres, the wire in
/// scene units
[[nodiscard]] proto::ResultInfo encode_result(const session::BodyResult& result,
                                              double length_unit);
/// The model of a session that is ready; empty before.
[[nodiscard]] proto::ModelInfo encode_model(const session::BodySession& session);

}  // namespace limber::server
