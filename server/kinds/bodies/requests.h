#pragma once

#include "server/kinds/bodies/scene.h"
#include "server/kinds/kind.h"

namespace limber::server {

/// The scene of a message, read by the server's limits. @throws as decode_scene()
[[nodiscard]] DecodedScene decode_body(const proto::Scene& message, const std::string& prefix,
                                       const SceneContext& context);

/// Requests of bodies without a session: tetrahedralize, simulate, recover. As Kind::answer().
[[nodiscard]] bool answer_body_request(const proto::Request& request, proto::Reply& reply, Hub& hub,
                                       const SceneContext& context);

}  // namespace limber::server
