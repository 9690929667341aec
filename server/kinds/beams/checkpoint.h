#pragma once

#include "engine/session/beams/document.h"
#include "limber/v1/stored.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The message that decodes to the same checkpoint, to the last digit, but for its revision.
[[nodiscard]] proto::StoredBeams encode_beam_checkpoint(
    const session::BeamDocument::Checkpoint& checkpoint);
/// @param revision  of the checkpoint
/// @throws Refusal or Error where it is none. References to edited objects are not checked:
/// BeamDocument::demand_reachable()
[[nodiscard]] session::BeamDocument::Checkpoint decode_beam_checkpoint(
    const proto::StoredBeams& message, session::Revision revision);

}  // namespace limber::server
