#pragma once

#include "engine/session/bodies/document.h"
#include "limber/v1/stored.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The message that decodes to the same checkpoint, to the last digit, but for its revision.
[[nodiscard]] proto::StoredBody encode_body_checkpoint(
    const session::Document::Checkpoint& checkpoint);
/// @param revision  of the checkpoint
/// @throws Refusal or Error where it is none. References to the body are not checked:
/// Document::demand_reachable()
[[nodiscard]] session::Document::Checkpoint decode_body_checkpoint(const proto::StoredBody& message,
                                                                   session::Revision revision);

}  // namespace limber::server
