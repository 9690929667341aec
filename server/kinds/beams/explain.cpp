#include "server/kinds/beams/explain.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/wire/explanation.h"

namespace limber::server {

proto::ExplainResponse explain_beams(const proto::SessionStatus& status,
                                     const proto::BeamScene& scene) {
  const proto::ResultInfo& result = status.result();
  const proto::BeamInfo& info = result.beams();
  const proto::DiscretisationError& error = result.discretisation_error();
  const bool has_error = result.has_discretisation_error();
  const bool is_known = has_error && error.compared_elements() > 0;
  Explanation explanation(result.revision());

  const std::uint32_t members = std::max(1U, status.beam_elements());
  const std::uint32_t elements = has_error && error.elements() > 0 ? error.elements() : members;
  // Beside elements_per_member a tolerance changes no elements.
  const bool by_tolerance = scene.has_tolerance() && !scene.has_elements_per_member();
  explanation.choose(
      "elements", elements, by_tolerance ? ChosenBy::kLimber : ChosenBy::kScene,
      by_tolerance ? fmt::format("of {} members; the scene's tolerance is {:g} of its size",
                                 members, scene.tolerance())
                   : fmt::format("of {} members, elements_per_member each; `tolerance` {} lets "
                                 "limber choose",
                                 members, scene.has_tolerance() ? "alone" : "in its place"),
      "unknowns, time and memory of a step grow in proportion");
  const bool relaxed = info.method() == proto::BEAM_METHOD_RELAXATION;
  explanation.choose(
      "path of the solve", relaxed ? "dynamic relaxation" : "Newton's method along the path",
      ChosenBy::kLimber,
      relaxed ? fmt::format("{} steps; it reaches a stable shape, and does not see snaps on the "
                            "way",
                            info.relaxation_steps())
              : fmt::format("{} load steps, {} iterations; it follows the branch of equilibria and "
                            "sees snaps: {}",
                            info.load_steps(), info.newton_iterations(), info.snaps_size()),
      time_since_edit(result));

  const std::string how = !has_error
                              ? std::string("found after the final result: wait until checked")
                          : is_known ? std::string(
                                           "every element halved and the equilibrium solved "
                                           "again near by")
                                     : "no estimate: " + error.message();
  const auto tolerance =
      scene.has_tolerance() ? std::optional<double>(scene.tolerance()) : std::optional<double>();
  explanation.expect("positions",
                     is_known ? std::optional<double>(error.position_error()) : std::nullopt,
                     "of the structure's size", how, tolerance);
  explanation.expect("elastic energy",
                     is_known ? std::optional<double>(error.energy_error()) : std::nullopt, "",
                     how);
  explanation.expect("equilibrium", info.residual(), "",
                     "unbalanced forces and moments over those present, of this very shape");
  explanation.expect("bend of an element, the largest", info.largest_bend(), "rad",
                     "between an end and its chord; above 0.5 elements are too long");
  const std::uint32_t each = std::max(1U, elements / members);
  explanation.advise("less error of the discretisation",
                     fmt::format("elements_per_member {}: of second order, a quarter of the error "
                                 "at twice the unknowns",
                                 2 * each));
  if (each > 1)
    explanation.advise("half the unknowns, and about half the time of a step",
                       fmt::format("elements_per_member {}: four times the error", each / 2));
  return explanation.response();
}

}  // namespace limber::server
