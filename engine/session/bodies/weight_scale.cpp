#include "engine/session/bodies/weight_scale.h"

#include <fmt/core.h>

#include <algorithm>

#include "engine/base/clauses.h"

namespace limber::session {

double next_weight_scale(double scale, double missed, double tolerance, bool& raised) {
  if (missed > tolerance && scale < kGreatestWeightScale) {
    raised = true;
    return std::min(kGreatestWeightScale, 10 * scale);
  }
  if (missed < 0.05 * tolerance && scale > 1 && !raised) return std::max(1.0, scale / 10);
  return scale;
}

void tell_tolerance(const scene::Scene& scene, double scale, spacetime::SolveReport& report) {
  if (!scene.constraint_tolerance) return;
  const double missed = report.max_constraint_error / scene.length_unit_in_metres;
  if (missed <= *scene.constraint_tolerance) return;
  append_clause(
      report.message,
      fmt::format(
          "constraint_tolerance {:g} is not met: {:.3g} is missed with weights raised {:g} times",
          *scene.constraint_tolerance, missed, scale));
}

}  // namespace limber::session
