#include "engine/session/beams/analysis.h"

#include <chrono>
#include <utility>

#include "engine/base/error.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/session/beams/shape_cache.h"

namespace limber::session {
BeamAnalysis analyse(beams::BeamModel model, const beams::BeamSolveOptions& options, int shapes,
                     const JobContext& job) {
  beams::BeamStructure structure(std::move(model));
  ShapeCache<Eigen::Matrix3Xd> keeper(shapes);
  beams::BeamSolution solution =
      find_equilibrium(structure, options, job, [&](const beams::BeamProgress& progress) {
        keeper.keep([&] { return progress.state->positions; });
      });
  job.throw_if_cancelled();
  beams::BeamResults results = results_of(structure, solution.state);
  return {std::move(structure), std::move(solution), std::move(results), keeper.take()};
}

DiscretisationCheck check_discretisation(const BeamAnalysis& analysis, const JobContext& job) {
  LIMBER_DEMAND(analysis.solution.report.converged());
  const auto begin = std::chrono::steady_clock::now();
  const beams::BeamModel& model = analysis.structure.model();
  DiscretisationCheck check;
  check.error =
      estimate_discretisation(model, {beams::Subdivision::even(model, 1), analysis.solution.state},
                              beams::kMaxCutElements, job)
          .error;
  check.check_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return check;
}

}  // namespace limber::session
