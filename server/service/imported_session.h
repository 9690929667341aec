#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "limber/v1/stored.pb.h"
#include "server/service/chosen_ids.h"

namespace limber::server {

/// Revisions and other counters of an imported session are below: what counts on from there is a
/// number for SQLite and for pages, however long the session lives. Ids are not bounded: clients of
/// earlier servers chose them.
inline constexpr std::uint64_t kMostImportedNumber = kLargestChosenId + 1;

/// Checks the numbers that a session continues from: counters that no server has reached. Counters
/// of documents are checked where they begin (demand_reachable).
/// @throws Refusal INVALID_ARGUMENT naming the field, e.g. content.checkpoint.body.last_number
void demand_countable(const proto::StoredSession& stored);

/// The bytes of an exported session, with their checksum as the last field.
[[nodiscard]] std::string sealed(const proto::StoredSession& stored);
/// Files of earlier servers have no checksum.
/// @throws Refusal INVALID_ARGUMENT where the bytes are not those that were sealed
void demand_unchanged(std::string_view content, const proto::StoredSession& stored);

}  // namespace limber::server
