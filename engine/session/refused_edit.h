#pragma once

#include <fmt/format.h>

#include <cstddef>

#include "engine/base/error.h"

namespace limber::session {

/// Runs `attempt(count)`, which tries so many edits from the first on and throws where they
/// together are not valid. What is thrown from here names the edit that made them so: the last of
/// the shortest beginnings that are refused.
/// @throws Error with field "edits[i]" and, behind a dot, the field of the attempt's error
template <class Attempt>
void try_edits(std::size_t count, const Attempt& attempt) {
  try {
    attempt(count);
    return;
  } catch (const Error&) {
  }
  std::size_t good = 0, bad = count;
  while (bad - good > 1) {
    const std::size_t middle = good + (bad - good) / 2;
    try {
      attempt(middle);
      good = middle;
    } catch (const Error&) {
      bad = middle;
    }
  }
  try {
    attempt(bad);
  } catch (const Error& error) {
    throw Error(
        error.code(),
        fmt::format("edits[{}]{}{}", bad - 1, error.field().empty() ? "" : ".", error.field()),
        error.what());
  }
}

}  // namespace limber::session
