#pragma once

#include <optional>
#include <string>

#include "engine/beams/refinement/discretisation_error.h"

namespace limber::session {

/// What a session of beams has found out about the equilibrium that it shows.
struct DiscretisationCheck {
  beams::DiscretisationError error;
  std::optional<double> tolerance;  // of error.position_error; none: none was asked for
  double check_ms = 0;              // that it took

  [[nodiscard]] bool within_tolerance() const {
    return error.is_known && (!tolerance || error.position_error <= *tolerance);
  }
};

/// Without a tolerance, errors above it are reported: share of the structure's size.
inline constexpr double kVisibleDiscretisationError = 0.01;

/// What is wrong with the shape and what to do: its error is above the tolerance (without one above
/// kVisibleDiscretisationError), or there is no estimate; empty where neither is so.
[[nodiscard]] std::string describe_discretisation(const DiscretisationCheck& check);

}  // namespace limber::session
