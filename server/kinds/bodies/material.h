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

/// z of its frames, frames x modes.
[[nodiscard]] proto::Array encode_coordinates(const session::BodyResult& result);

/// @throws Refusal LIMIT_EXCEEDED naming with_candidates: more than `message_bytes`;
/// Error{kFailedPrecondition}: the session's model has other candidates by now than the response's
void add_candidates(const session::BodySession& session, std::uint64_t message_bytes,
                    proto::GetMaterialResponse& response);

}  // namespace limber::server
