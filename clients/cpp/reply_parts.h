#pragma once

#include "clients/cpp/error.h"
#include "limber/v1/service.pb.h"

namespace limber::client {

// Answers that come in parts (parts.proto).

/// Whether the answer is to come in parts where it is long: it may be as large as a session's
/// scene, basis or structure. Frames of a motion come in parts of their own, where they can be
/// divided.
[[nodiscard]] bool may_have_long_answer(const v1::Request& request);

/// An older server refuses a field of a request that it does not know: that its answer can come in
/// parts.
[[nodiscard]] bool knows_no_parts(const ClientError& error);

/// The server no longer keeps the answer whose parts were fetched: request it anew.
[[nodiscard]] bool is_gone(const ClientError& error);

}  // namespace limber::client
