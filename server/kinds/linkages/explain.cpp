#include "server/kinds/linkages/explain.h"

#include <fmt/format.h>

#include "server/wire/explanation.h"

namespace limber::server {
namespace {

void add_path(const proto::ResultInfo& result, Explanation& explanation) {
  const proto::LinkageInfo& info = result.linkage();
  if (!result.converged()) {
    explanation.choose("path of the solve", "one corrected step", ChosenBy::kLimber,
                       "equilibria along the path from the last one follow",
                       time_since_edit(result));
    return;
  }
  std::string reason = fmt::format(
      "Newton's method along the path from the last equilibrium, step by step, since the branch "
      "may turn; {} factorisations",
      info.factorizations());
  if (info.escapes() > 0) reason += fmt::format("; {} saddles were left along it", info.escapes());
  explanation.choose("path of the solve",
                     fmt::format("{} equilibria, the last one with {} unstable directions",
                                 info.steps(), info.negative_eigenvalues()),
                     ChosenBy::kLimber, reason, time_since_edit(result));
}

}  // namespace

proto::ExplainResponse explain_linkage(const proto::SessionStatus& status,
                                       const proto::RodLinkage& linkage, ChosenBy edges_by) {
  const proto::ResultInfo& result = status.result();
  Explanation explanation(result.revision());
  const bool has_tolerance = linkage.has_tolerance();
  const std::uint32_t edges = linkage.edges_per_segment();
  std::string reason;
  if (edges_by == ChosenBy::kLimber) {
    reason =
        fmt::format("the scene's tolerance is {:g} of the linkage's size", linkage.tolerance());
  } else if (has_tolerance) {
    reason = fmt::format(
        "edges_per_segment of the scene; results are held against its tolerance, {:g} of the "
        "linkage's size, which would choose them alone",
        linkage.tolerance());
  } else {
    reason =
        "edges_per_segment of the scene or its default; `tolerance` in its place lets limber "
        "choose";
  }
  explanation.choose("edges per segment", edges, edges_by, reason,
                     "unknowns, time and memory of a step grow in proportion");
  const bool turning = linkage.bending() == proto::ROD_BENDING_TURNING_ANGLE;
  explanation.choose("bending", turning ? "turning angle" : "tangent of half the turning angle",
                     ChosenBy::kScene,
                     turning ? "curvature is the angle itself: exact for circular arcs, and finite "
                               "where edges fold back"
                             : "as published and in public codes, for comparisons with them");
  add_path(result, explanation);
  const char* const kHow =
      "every edge halved and the equilibrium solved again near by; of second order, so that the "
      "change is three quarters of the error";
  const auto tolerance =
      has_tolerance ? std::optional<double>(linkage.tolerance()) : std::optional<double>();
  const proto::DiscretisationError& error = result.discretisation_error();
  const bool is_known = result.has_discretisation_error() && error.compared_elements() > 0;
  const std::string how = !result.has_discretisation_error()
                              ? std::string("found after the final result: wait until checked")
                          : is_known ? std::string(kHow)
                                     : "no estimate: " + error.message();
  explanation.expect("positions",
                     is_known ? std::optional<double>(error.position_error()) : std::nullopt,
                     "of the linkage's size", how, tolerance);
  explanation.expect("elastic energy",
                     is_known ? std::optional<double>(error.energy_error()) : std::nullopt, "",
                     how);
  explanation.expect("equilibrium", result.linkage().max_gradient_scaled(), "",
                     "unbalanced forces over the forces present, of this very shape");
  explanation.advise("half the error of the discretisation",
                     fmt::format("edges_per_segment {}: of second order, 1.4 times the edges",
                                 (edges * 7 + 4) / 5));
  if (edges >= 6)
    explanation.advise("half the edges, and about half the time of a step",
                       fmt::format("edges_per_segment {}: four times the error", edges / 2));
  return explanation.response();
}

}  // namespace limber::server
