#pragma once

#include <fmt/format.h>

#include <cstddef>

#include "engine/base/error.h"
#include "engine/session/core/limit_error.h"

namespace limber::session {

/// Runs `attempt(count, taken)`, which applies the first `count` edits and counts the applied ones
/// in `taken`. It throws if one of them cannot be applied or if they together are not valid. Errors
/// thrown from here name the edit at fault: the one that cannot be applied, or the last of the
/// shortest beginning that is refused. An edit that cannot be taken costs two attempts, one that
/// makes the others invalid as many as halving takes.
/// @throws Error with field "edits[i]" and, behind a dot, the field of the attempt's error
template <class Attempt>
void try_edits(std::size_t count, const Attempt& attempt) {
  const auto is_refused = [&](std::size_t beginning, std::size_t& taken) {
    try {
      taken = 0;
      attempt(beginning, taken);
      return false;
    } catch (const Error&) {
      return true;
    }
  };
  std::size_t taken = 0, ignored = 0;
  if (!is_refused(count, taken)) return;
  std::size_t good = 0, bad = count;
  if (taken < count) {
    bad = taken + 1;
    (taken == 0 || !is_refused(taken, ignored) ? good : bad) = taken;
  }
  while (bad - good > 1) {
    const std::size_t middle = good + (bad - good) / 2;
    (is_refused(middle, ignored) ? bad : good) = middle;
  }
  try {
    ignored = 0;
    attempt(bad, ignored);
  } catch (const Error& error) {
    rethrow_at(error, fmt::format("edits[{}]{}{}", bad - 1, error.field().empty() ? "" : ".",
                                  error.field()));
  }
}

}  // namespace limber::session
