#pragma once

#include "engine/session/linkages/document.h"
#include "limber/v1/stored.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The message that decodes to the same checkpoint, to the last digit, but for its revision.
[[nodiscard]] proto::StoredLinkage encode_linkage_checkpoint(
    const session::LinkageDocument::Checkpoint& checkpoint);
/// @param revision  of the checkpoint
/// @throws Refusal or Error where it is none. References to edited objects are not checked:
/// LinkageDocument::demand_reachable()
[[nodiscard]] session::LinkageDocument::Checkpoint decode_linkage_checkpoint(
    const proto::StoredLinkage& message, session::Revision revision);

}  // namespace limber::server
