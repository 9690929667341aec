#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/core/values.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The kind of an edit: the member of its oneof; null if it is empty.
[[nodiscard]] const google::protobuf::FieldDescriptor* edit_kind(const proto::Edit& edit);

[[nodiscard]] inline session::Whose whose(bool anyone) {
  return anyone ? session::Whose::kAnyone : session::Whose::kOwn;
}

/// The members of its edits, each once, in their order.
[[nodiscard]] std::vector<std::string> kinds_of_edits(const proto::EditRequest& request);

/// A field of the engine's edits ("edits[2].node") as one of the request
/// ("edits[2].set_beam_load.load.node"), as field_in().
/// @param extension  what extensions of edits are; null: they are not read
[[nodiscard]] std::string edit_field_in(const proto::EditRequest& message, const std::string& field,
                                        const google::protobuf::Message* extension = nullptr);

/// Members common to responses of every kind: revision and warnings.
[[nodiscard]] proto::EditResponse begin_response(const session::EditReceipt& receipt);

/// The revision that the session must be at, where the request names one.
[[nodiscard]] std::optional<std::uint64_t> expected_revision(const proto::EditRequest& message);

}  // namespace limber::server
