#include "engine/rods/equilibrium/equilibrium_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace limber::rods::detail {

std::string place_of(const ReducedVariables& variables, int unknown) {
  if (unknown >= variables.joint_begin(0))
    return fmt::format("joint {}", (unknown - variables.joint_begin(0)) / kJointUnknowns);
  int low = 0, high = variables.segments() - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (variables.chain_begin(middle) <= unknown) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  return fmt::format("segment {}", low);
}

std::string imbalance_text(const ReducedVariables& variables, const UnknownScales& scales,
                           const Eigen::VectorXd& gradient, const GradientSize& present,
                           double tolerance, double beyond) {
  const int worst = scales.most_unbalanced(gradient, present, tolerance, beyond);
  const double percent = 100 * scales.imbalance(gradient, present, tolerance, beyond);
  if (worst < 0 || !std::isfinite(percent)) return "the forces are not finite";
  const bool is_force = scales.kind(worst) == UnknownKind::kLength;
  const std::string size = is_force ? fmt::format("{:.2g} N, ", std::abs(gradient[worst])) : "";
  return fmt::format("the {} at {} is out of balance by {}{:.2g} % of the largest (limit {:.2g} %)",
                     is_force ? "force" : "moment", place_of(variables, worst), size, percent,
                     100 * tolerance);
}

std::string degenerate_text(const LinkageModel& model, const LinkageState& state) {
  double worst = std::numeric_limits<double>::infinity();
  int where = 0;
  for (int s = 0; s < model.variables().segments(); ++s) {
    const int edges = model.variables().edges(s);
    for (int i = 0; i < edges; ++i) {
      const Eigen::Vector3d at = state.vertex(model, s, i + 1);
      const Eigen::Vector3d before = at - state.vertex(model, s, i);
      double openness = before.norm();  // 0: no length, or a fold after it
      if (i + 1 < edges) {
        const Eigen::Vector3d after = state.vertex(model, s, i + 2) - at;
        openness = std::min(openness, before.norm() + before.dot(after) / after.norm());
      }
      if (openness >= worst) continue;  // not a number is worse than all
      worst = openness;
      where = s;
    }
  }
  return fmt::format(
      "segment {} has an edge that has no length or is folded back: begin from another shape, or "
      "request the change in smaller steps",
      where);
}

}  // namespace limber::rods::detail
