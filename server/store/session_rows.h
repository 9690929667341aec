#pragma once

#include <cstdint>

#include "limber/v1/stored.pb.h"
#include "server/store/sqlite.h"

namespace limber::server::store {

/// Reads all that is stored of a session. Damaged data are never passed on. A damaged answer is
/// left out, with a line in the log (edits can be solved again); anything else is refused.
/// @pre within one transaction: a checkpoint may be written meanwhile
/// @throws Error{kNotFound, "session"}; {kIo, "session"} naming the row that is damaged
[[nodiscard]] limber::v1::StoredSession read_session(Database& database, std::uint64_t uid);

/// Removes the seals of rows (row_seal.h). A server that knows none exports them with its sessions.
void clear_seals(limber::v1::StoredSession& session);

}  // namespace limber::server::store
