#include "clients/cli/beams/words.h"

#include <fmt/format.h>

namespace limber::cli::beams {

std::string inertia_words(unsigned negative_eigenvalues) {
  if (negative_eigenvalues == 0) return "";
  return fmt::format(" ({} negative eigenvalue{})", negative_eigenvalues,
                     negative_eigenvalues == 1 ? "" : "s");
}

std::string snap_words(const v1::BeamSnap& snap) {
  return fmt::format("at {:.3f} of the path: node {} turns by {:.3g} rad", snap.progress(),
                     snap.node(), snap.turn());
}

std::string overload_words(double utilisation) {
  if (utilisation <= 1) return "";
  return fmt::format(", OVERLOADED: the largest stress is {:.3g} times the yield stress",
                     utilisation);
}

std::string discretisation_words(const v1::DiscretisationError& error) {
  if (error.compared_elements() == 0) return "not known: " + error.message();
  const std::string tolerance =
      error.tolerance() > 0 ? fmt::format("; tolerance {:.2g} %", 100 * error.tolerance()) : "";
  return fmt::format(
      "positions off by {:.2g} % of the size ({:.3g} m at node {}{}), energy by {:.2g} %; {} "
      "elements against {}",
      100 * error.position_error(), error.max_distance(), error.worst_node(), tolerance,
      100 * error.energy_error(), error.elements(), error.compared_elements());
}

}  // namespace limber::cli::beams
