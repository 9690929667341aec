#pragma once

#include <string>

#include "engine/base/error.h"

namespace limber::scene {

/// One thing that is wrong, and where: `field` is a path such as "constraints[3].frame".
struct Issue {
  enum class Severity { kWarning, kError };
  Severity severity = Severity::kError;
  std::string field;
  std::string message;
  ErrorCode code =
      ErrorCode::kInvalidArgument;  // of errors: what opening the scene is refused with
};

}  // namespace limber::scene
