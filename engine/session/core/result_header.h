#pragma once

#include <cstdint>

#include "engine/session/core/values.h"

namespace limber::session {

/// Members of every published result, for sessions of every kind.
struct ResultHeader {
  Revision revision = 0;       // every edit up to and including this one is in it
  std::uint64_t sequence = 0;  // counts published results of the session from 1, or as
                               // Listener::first_sequence() says; no gaps
  bool is_final = false;       // for this revision, with any status in the report
  /// Nothing was reached: the answer is the last one there was, and the report says why.
  bool solve_failed = false;
  double since_edit_ms = 0;  // from the newest edit contained to publication
};

}  // namespace limber::session
