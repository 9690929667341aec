#pragma once

#include <vector>

#include "engine/session/beams/edit.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// @param nodes  of the structure as drawn: what positions are measured from
/// @throws Refusal with fields "edits[i].set_beam_load...."; INVALID_ARGUMENT for edits of other
/// sessions
[[nodiscard]] std::vector<session::BeamEdit> decode_beam_edits(
    const proto::EditRequest& request, const std::vector<beams::BeamNode>& nodes);
[[nodiscard]] proto::EditResponse encode_beam_receipt(const session::EditReceipt& receipt);

}  // namespace limber::server
