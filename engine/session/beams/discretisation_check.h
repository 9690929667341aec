#pragma once

#include <optional>
#include <string>

#include "engine/beams/refinement/discretisation_error.h"

namespace limber::session {

/// Results about the equilibrium that a session of beams shows.
struct DiscretisationCheck {
  beams::DiscretisationError error;
  std::optional<double> tolerance;  // of positions; none: none was requested
  double check_ms = 0;              // that it took

  [[nodiscard]] bool within_tolerance() const { return error.is_known && is_fine_enough(); }
  /// True if the compared elements are short enough: shorter ones would not help.
  [[nodiscard]] bool is_fine_enough() const {
    return !tolerance || error.error_against(*tolerance) <= *tolerance;
  }
};

/// Without a tolerance, errors above it are reported: shares of the structure's size, and of the
/// largest moment and utilisation.
inline constexpr double kVisibleDiscretisationError = 0.01;

/// The problem of the shape and its remedy: the error exceeds the tolerance (without one,
/// kVisibleDiscretisationError), or there is no estimate. Empty otherwise.
[[nodiscard]] std::string describe_discretisation(const DiscretisationCheck& check);

}  // namespace limber::session
