#include "engine/beams/solver/equilibrium.h"

#include "engine/beams/solver/newton_path.h"
#include "engine/beams/solver/relaxation_path.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams {

namespace {

BeamSolution solve(const BeamStructure& structure, const BeamState& start,
                   const detail::LoadPath& path, const BeamSolveOptions& options,
                   const JobContext& context, const BeamObserver& observer) {
  options.validate();
  BeamSolution solution{start, {}};
  BeamReport& report = solution.report;
  try {
    switch (options.method) {
      case BeamMethod::kRelaxation:
        report.method = options.method;
        detail::relax(structure, path, options.relaxation_tolerance, options, context, observer,
                      solution.state, report);
        break;
      case BeamMethod::kRelaxationThenNewton:
        report.method = options.method;
        detail::relax(structure, path, options.hand_over, options, context, observer,
                      solution.state, report);
        if (report.converged())
          detail::follow_path(structure, path, 1, options, context, observer, solution.state,
                              report);
        break;
      default:
        report.method = BeamMethod::kNewton;
        detail::follow_path(structure, path, 0, options, context, observer, solution.state, report);
    }
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
    report.status = BeamStatus::kCancelled;
    report.message = "cancelled";
  }
  report.elastic_energy = elastic_energies(structure, solution.state).total();
  return solution;
}

}  // namespace

BeamSolution find_equilibrium(const BeamStructure& structure, const BeamSolveOptions& options,
                              const JobContext& context, const BeamObserver& observer) {
  const BeamState start = structure.rest_state();
  return solve(structure, start, detail::LoadPath(structure, start, true), options, context,
               observer);
}

BeamSolution find_equilibrium_from(const BeamStructure& structure, const BeamState& start,
                                   const BeamSolveOptions& options, const JobContext& context,
                                   const BeamObserver& observer) {
  return solve(structure, start, detail::LoadPath(structure, start, false), options, context,
               observer);
}

}  // namespace limber::beams
