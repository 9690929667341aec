#pragma once

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// Each mode as it swings in SI units of these frames.
void encode_modes(const spacetime::ModeDynamics& dynamics, double frames_per_second,
                  google::protobuf::RepeatedPtrField<proto::ModeDynamics>& modes);

/// The material of a result, in SI units of these frames.
[[nodiscard]] proto::GetMaterialResponse encode_fitted_material(const session::BodyResult& result,
                                                                double frames_per_second);

}  // namespace limber::server
