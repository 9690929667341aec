#pragma once

#include <vector>

#include "engine/session/linkages/edit.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// @throws Refusal with fields "edits[i].pin_joint...."; INVALID_ARGUMENT for edits of other
/// sessions
[[nodiscard]] std::vector<session::LinkageEdit> decode_linkage_edits(
    const proto::EditRequest& request);
[[nodiscard]] proto::EditResponse encode_linkage_receipt(const session::EditReceipt& receipt);

}  // namespace limber::server
