#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// What an edit is of: the member of its oneof; null where it is empty.
[[nodiscard]] const google::protobuf::FieldDescriptor* edit_kind(const proto::Edit& edit);

/// The index of the edit that a field of the engine's errors is of, "edits[2].node"; nothing where
/// it is of none in the request.
[[nodiscard]] std::optional<int> edit_index(const proto::EditRequest& message,
                                            const std::string& field);

/// The engine names members of its own edits ("edits[2].node"); this is the same place in the
/// request ("edits[2].set_beam_load.load.node"). Of linkages and of structures of beams.
[[nodiscard]] std::string edit_field_in(const proto::EditRequest& message,
                                        const std::string& field);

/// The warnings of a receipt, with fields of the request as edit_field_in() finds them.
void add_issues(const proto::EditRequest& message, const std::vector<scene::Issue>& issues,
                proto::EditResponse& response);

/// The revision that the session must be at, where the request names one.
[[nodiscard]] std::optional<std::uint64_t> expected_revision(const proto::EditRequest& message);

/// Of a request whose edits begin more steps of undo than one request may.
[[nodiscard]] bool is_too_many_steps(const Error& error);
/// @pre is_too_many_steps
/// @param limit  how many it may
[[nodiscard]] Refusal too_many_steps(const std::string& field, const Error& error, int limit);

}  // namespace limber::server
