#include "engine/session/linkages/rest_shape.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/rest_length_solve.h"

namespace limber::session {

rods::LinkageState rest_shape(MappedLinkage& mapped, scene::RestLengthChoice choice,
                              const JobContext& job) {
  rods::LinkageState state(mapped.model);
  if (choice == scene::RestLengthChoice::kAsDrawn) return state;
  job.report("rest lengths", 0);
  const rods::RestLengthReport report = rods::solve_rest_lengths(mapped.model, state, {}, job);
  job.throw_if_cancelled();
  if (!report.converged()) {
    throw Error(ErrorCode::kNumerical, "rest_lengths",
                fmt::format("no lengths of least stress were found: {}", report.message));
  }
  return state;
}

}  // namespace limber::session
