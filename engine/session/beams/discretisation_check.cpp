#include "engine/session/beams/discretisation_check.h"

#include <fmt/format.h>

namespace limber::session {

std::string describe_discretisation(const DiscretisationCheck& check) {
  const beams::DiscretisationError& error = check.error;
  if (!error.is_known)
    return fmt::format(
        "The discretisation error could not be estimated: {}. Set elements_per_member or tolerance "
        "of the scene for shorter elements.",
        error.message);
  if (error.position_error <= check.tolerance.value_or(kVisibleDiscretisationError)) return {};
  std::string text = fmt::format(
      "Positions are off by about {:.2g} % of the structure's size by its discretisation, most at "
      "node {}",
      100 * error.position_error, error.worst_node);
  if (check.tolerance) text += fmt::format(" (tolerance {:.2g} %)", 100 * *check.tolerance);
  text += ": set a larger elements_per_member of the scene";
  if (!check.tolerance) text += ", or a tolerance";
  text += ".";
  if (!error.message.empty()) text += fmt::format(" The estimate is uncertain: {}.", error.message);
  return text;
}

}  // namespace limber::session
