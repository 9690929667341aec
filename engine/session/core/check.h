#pragma once

namespace limber::session {

/// Whether the error of a final result has been looked for.
enum class Check {
  kNone,     // it is not: not final, or the solve failed
  kPending,  // an amendment will follow, unless an edit is quicker
  kDone,     // this is the amendment
};

}  // namespace limber::session
