#pragma once

#include <optional>
#include <string>

#include "engine/beams/refinement/discretisation_error.h"

namespace limber::session {

/// What a session of beams has found out about the equilibrium that it shows.
struct DiscretisationCheck {
  beams::DiscretisationError error;
  std::optional<double> tolerance;  // of positions; none: none was requested
  double check_ms = 0;              // that it took

  [[nodiscard]] bool within_tolerance() const { return error.is_known && is_fine_enough(); }
  /// The same of what was compared: shorter elements would not help.
  [[nodiscard]] bool is_fine_enough() const {
    return !tolerance || error.error_against(*tolerance) <= *tolerance;
  }
};

/// Without a tolerance, errors above it are reported: shares of the structure's size, and of the
/// largest moment and utilisation.
inline constexpr double kVisibleDiscretisationError = 0.01;

/// What is wrong with the shape and what to do: its error is above the tolerance (without one above
/// kVisibleDiscretisationError), or there is no estimate; empty where neither is so.
[[nodiscard]] std::string describe_discretisation(const DiscretisationCheck& check);

}  // namespace limber::session
