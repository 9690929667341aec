#include "engine/session/beams/discretisation_check.h"

#include <fmt/format.h>

namespace limber::session {
namespace {

/// An error above the limit, in the words of a sentence.
struct Excess {
  const char* subject;
  const char* lower_case;
  const char* scale;
  double error;
  double limit;
  std::string place;
};

std::string describe(const Excess& excess, bool is_first) {
  if (is_first)
    return fmt::format("{} are off by about {:.2g} % of {} by its discretisation, most {}",
                       excess.subject, 100 * excess.error, excess.scale, excess.place);
  return fmt::format("; {} by {:.2g} % of {}, most {}", excess.lower_case, 100 * excess.error,
                     excess.scale, excess.place);
}

}  // namespace

std::string describe_discretisation(const DiscretisationCheck& check) {
  const beams::DiscretisationError& error = check.error;
  if (!error.is_known) {
    // Compared all the same: cables are in the way, which no setting cuts.
    const char* const advice =
        error.compared_elements > 0
            ? ""
            : " Use shorter elements: elements_per_member or tolerance of a scene.";
    return fmt::format("The discretisation error could not be estimated: {}.{}", error.message,
                       advice);
  }
  const double limit = check.tolerance.value_or(kVisibleDiscretisationError);
  const double force_limit = beams::force_tolerance(limit);
  const Excess errors[] = {
      {"Positions", "positions", "the structure's size", error.position_error, limit,
       fmt::format("at node {}", error.worst_node)},
      {"Bending moments", "bending moments", "the structure's largest", error.moment_error,
       force_limit, fmt::format("in element {}", error.worst_moment_element)},
      {"Utilisations", "utilisations", "the structure's largest",
       error.utilisation_error.value_or(0), force_limit,
       fmt::format("in element {}", error.worst_utilisation_element)}};
  std::string text;
  for (const Excess& excess : errors) {
    if (excess.error > excess.limit) text += describe(excess, text.empty());
  }
  if (text.empty()) return {};
  if (check.tolerance)
    text += fmt::format(" (tolerance {:.2g} %, of moments and utilisations {:.2g} %)", 100 * limit,
                        100 * force_limit);
  text += ": use shorter elements (elements_per_member";
  text += check.tolerance ? " of the scene)" : " or tolerance of a scene)";
  text += ".";
  if (!error.message.empty()) text += fmt::format(" The estimate is uncertain: {}.", error.message);
  return text;
}

}  // namespace limber::session
