#include "engine/session/linkages/shape_check.h"

#include <fmt/format.h>

#include <chrono>

#include "engine/rods/linkage/drawn_extent.h"
#include "engine/session/linkages/session.h"

namespace limber::session {

std::string describe_shape(const ShapeCheck& check) {
  if (check.within_tolerance() || !(check.tolerance > 0)) return {};
  if (!check.error.is_known()) {
    return fmt::format("Whether the shape is within its tolerance is not known: {}.",
                       check.error.message);
  }
  return fmt::format(
      "Positions are off by {:.2g} of the linkage's size with {} edges (tolerance {:.2g}): open "
      "the "
      "scene with these conditions and the tolerance, or with more edges_per_segment.",
      check.position_error(), check.error.edges, check.tolerance);
}

ShapeChecker::ShapeChecker(const LinkageStatics& statics, double tolerance)
    : size_(rods::drawn_extent(statics.model().graph())),
      tolerance_(tolerance),
      estimator_(statics.model(), statics.stresses()) {}

ShapeCheck ShapeChecker::check(const LinkageResult& result, const JobContext& job) {
  const auto begin = std::chrono::steady_clock::now();
  ShapeCheck check{{}, size_, tolerance_};
  check.error = estimator_.estimate(result.statics->model(), *result.state, *result.held, job);
  check.check_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return check;
}

}  // namespace limber::session
