#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/session/core/limit_error.h"
#include "engine/session/core/refused_edit.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// Conditions that every document sets on a request, before it reads the edits.
/// @param count  of edits
/// @param expected  the revision that the client saw last, where it wants to be refused if there
/// are newer ones
/// @throws Error{kFailedPrecondition, "expected_revision"}, Error{kInvalidArgument, "edits"}
inline void demand_request(std::size_t count, std::optional<Revision> expected, Revision revision) {
  if (expected && *expected != revision) {
    throw Error(ErrorCode::kFailedPrecondition, "expected_revision",
                fmt::format("the session is at revision {}, not {}", revision, *expected));
  }
  if (count == 0) throw Error(ErrorCode::kInvalidArgument, "edits", "there are no edits");
}

/// @param steps  of undo that end inside of the request
/// @throws LimitError "steps_at_once"
inline void demand_steps(int steps, int steps_at_once) {
  if (steps <= steps_at_once) return;
  const auto limit = static_cast<std::uint64_t>(steps_at_once);
  throw LimitError("steps_at_once",
                   fmt::format("the edits of one request begin more than {} steps of undo: send "
                               "them in several requests",
                               steps_at_once),
                   limit, limit + 1);
}

/// Edits tried on a copy of a document's values, not yet part of the document.
template <class Values>
struct PreparedEdits {
  Values values;
  EditReceipt receipt;  // without its revision
};

/// Tries edits on copies of a document's values; the document does not change.
/// @param begin  makes a request on a fresh copy. Its apply(edit) throws if it refuses, otherwise
///   returns the id of the edited item (or nothing: 0). Its finish() gives the values or throws if
///   the edits together are not valid. It also has take_warnings().
/// @throws Error as demand_request and, for the first edit that is refused, as try_edits
template <class Edit, class Begin>
[[nodiscard]] auto prepare_edits(const std::vector<Edit>& edits, std::optional<Revision> expected,
                                 Revision revision, const Begin& begin) {
  using Values = decltype(begin().finish());
  demand_request(edits.size(), expected, revision);
  EditReceipt receipt;
  std::optional<Values> values;
  try_edits(edits.size(), [&](std::size_t count, std::size_t& taken) {
    auto request = begin();
    receipt.constraint_ids.clear();
    for (; taken < count; ++taken) {
      std::uint64_t id = 0;
      if constexpr (std::is_void_v<decltype(request.apply(edits[taken]))>)
        request.apply(edits[taken]);
      else
        id = request.apply(edits[taken]);
      receipt.constraint_ids.push_back(id);
    }
    values.emplace(request.finish());
    receipt.issues = request.take_warnings();
  });
  LIMBER_DEMAND(values.has_value());
  receipt.keyframe_ids.assign(edits.size(), 0);
  return PreparedEdits<Values>{std::move(*values), std::move(receipt)};
}

/// Makes prepared edits the document's next revision. The values before are left in `prepared`:
/// they may take long to free, which is for the caller to do without a lock.
template <class Values>
EditReceipt commit_edits(PreparedEdits<Values>& prepared, Values& values, Revision& revision) {
  std::swap(values, prepared.values);
  prepared.receipt.revision = ++revision;
  return std::move(prepared.receipt);
}

}  // namespace limber::session
