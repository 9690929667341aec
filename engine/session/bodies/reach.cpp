#include "engine/session/bodies/reach.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {
namespace {

using spacetime::ConstraintMiss;
using spacetime::PositionConstraint;

/// That are named one by one.
constexpr std::size_t kListed = 5;

const PositionConstraint* find_constraint(const std::vector<PositionConstraint>& constraints,
                                          spacetime::ConstraintId id) {
  const auto found = std::find_if(constraints.begin(), constraints.end(),
                                  [id](const PositionConstraint& one) { return one.id == id; });
  return found == constraints.end() ? nullptr : &*found;
}

}  // namespace

std::vector<ConstraintMiss> out_of_reach(const spacetime::SolveReport& report,
                                         const std::vector<PositionConstraint>& constraints,
                                         double length) {
  using spacetime::SolveStatus;
  std::vector<ConstraintMiss> missed;
  if (report.status == SolveStatus::kCancelled) return missed;
  const bool is_optimum = report.status == SolveStatus::kConverged;
  for (const ConstraintMiss& miss : report.missed) {
    const PositionConstraint* const constraint = find_constraint(constraints, miss.id);
    if (constraint == nullptr) continue;
    const bool is_far = constraint->target.norm() > kFarTarget * length;
    if (!is_far && !(is_optimum && miss.is_exact && !report.rank_deficient)) continue;
    const bool is_known = std::any_of(missed.begin(), missed.end(), [&](const ConstraintMiss& one) {
      return constraint_of(one.id) == constraint_of(miss.id);
    });
    if (!is_known) missed.push_back(miss);  // of a path the worst frame
  }
  return missed;
}

std::string describe_reach(const std::vector<ConstraintMiss>& missed,
                           const std::vector<PositionConstraint>& constraints, double length,
                           double length_unit) {
  if (missed.empty()) return {};
  std::string text;
  bool is_any_soft = false;
  for (std::size_t i = 0; i < std::min(missed.size(), kListed); ++i) {
    const PositionConstraint* const constraint = find_constraint(constraints, missed[i].id);
    if (constraint == nullptr) continue;
    is_any_soft = is_any_soft || !missed[i].is_exact;
    text += fmt::format(
        "{}Constraint {} in frame {} is out of reach: the motion stops {:.3g} body lengths ({:.4g} "
        "in the scene's unit) short of its target, which is {:.3g} body lengths from rest.",
        text.empty() ? "" : " ", constraint_of(missed[i].id), constraint->frame,
        missed[i].distance / length, missed[i].distance / length_unit,
        constraint->target.norm() / length);
  }
  if (missed.size() > kListed)
    text += fmt::format(" So are {} more constraints.", missed.size() - kListed);
  text += missed.size() == 1 ? " Move the target nearer" : " Move the targets nearer";
  return text + (is_any_soft ? ", or raise the weight." : ".");
}

}  // namespace limber::session
