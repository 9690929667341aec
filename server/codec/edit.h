#pragma once

#include <vector>

#include "engine/session/edit.h"
#include "limber/v1/service.pb.h"
#include "server/codec/errors.h"

namespace limber::server {

/// @throws Refusal with fields "edits[i].add.constraint...."
[[nodiscard]] std::vector<session::Edit> decode_edits(const proto::EditRequest& request);
[[nodiscard]] proto::EditResponse encode_receipt(const session::EditReceipt& receipt);

}  // namespace limber::server
