#pragma once

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

/// Explains the choices for a session of a body, and the quality of its newest result.
/// @param session  of the status, ready
/// @param status  with model and result, as the session is ready
/// @param columns  of the basis that the result is shown in, h'
[[nodiscard]] limber::v1::ExplainResponse explain_body(const limber::v1::SessionStatus& status,
                                                       const session::BodySession& session,
                                                       int columns);

}  // namespace limber::server
