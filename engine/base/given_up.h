#pragma once

#include "engine/base/error.h"

namespace limber {

/// @returns whether `work` threw Error{kCancelled}: its result is no longer needed
template <class Work>
bool is_given_up(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kCancelled) return true;
    throw;
  }
  return false;
}

}  // namespace limber
