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

std::string neutral_words(const v1::BeamNeutralDirection& direction) {
  const auto& moves = direction.translation();
  return fmt::format("node {} moves by ({:.3g}, {:.3g}, {:.3g}) m per radian", direction.node(),
                     moves.x(), moves.y(), moves.z());
}

std::string unjudged_words(const google::protobuf::RepeatedField<std::uint32_t>& elements) {
  return fmt::format("{} {}", elements.size() == 1 ? "element" : "elements",
                     fmt::join(elements.begin(), elements.end(), ", "));
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
  const std::string utilisation =
      error.has_utilisation_error()
          ? fmt::format(", utilisations by {:.2g} % (element {})", 100 * error.utilisation_error(),
                        error.worst_utilisation_element())
          : "";
  return fmt::format(
      "positions off by {:.2g} % of the size ({:.3g} m at node {}{}), bending moments by {:.2g} % "
      "of "
      "the largest (element {}){}, energy by {:.2g} %; {} elements against {}",
      100 * error.position_error(), error.max_distance(), error.worst_node(), tolerance,
      100 * error.moment_error(), error.worst_moment_element(), utilisation,
      100 * error.energy_error(), error.elements(), error.compared_elements());
}

}  // namespace limber::cli::beams
