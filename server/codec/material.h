#pragma once

#include "engine/session/session.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The material of a result, in SI units of these frames.
[[nodiscard]] proto::GetMaterialResponse encode_fitted_material(const session::Result& result,
                                                                double frames_per_second);

}  // namespace limber::server
