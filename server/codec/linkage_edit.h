#pragma once

#include <string>
#include <vector>

#include "engine/session/linkage/linkage_edit.h"
#include "limber/v1/service.pb.h"
#include "server/codec/errors.h"

namespace limber::server {

/// @throws Refusal with fields "edits[i].pin_joint...."; INVALID_ARGUMENT for edits that only
/// bodies take
[[nodiscard]] std::vector<session::LinkageEdit> decode_linkage_edits(
    const proto::EditRequest& request);
[[nodiscard]] proto::EditResponse encode_linkage_receipt(const session::EditReceipt& receipt);

/// As linkage_field_in(), for "edits[i].joint" and the like.
[[nodiscard]] std::string linkage_field_in(const proto::EditRequest& message,
                                           const std::string& field);

}  // namespace limber::server
