#include "engine/session/beams/analysis.h"

#include <utility>

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

}  // namespace limber::session
