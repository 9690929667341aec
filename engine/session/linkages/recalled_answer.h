#pragma once

#include <string>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// The final answer that a session gave in the shape of its scene, before it was stored.
struct RecalledAnswer {
  Revision revision = 0;  // of the request
  rods::EquilibriumStatus status = rods::EquilibriumStatus::kConverged;
  bool solve_failed = false;  // the shape is the last equilibrium before
  std::string message;
};

}  // namespace limber::session
