// Discretisation errors of beams: estimates against the truth, and the cost of a tolerance.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <utility>

#include "bench/beam_truth.h"
#include "bench/cpu_time.h"
#include "bench/suite.h"
#include "engine/beams/refinement/subdivision_choice.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_structures.h"

namespace limber::bench {
namespace {

using beams::BeamModel;
using beams::BeamState;
using beams::BeamStructure;
using beams::Subdivision;

void run_known(const SuiteOptions& options, Recorder& recorder) {
  for (const KnownStructure& known : known_structures()) {
    for (const int elements : {5, 10, 20, 40}) {
      if (!is_selected(known.name)) continue;
      const BeamModel model = known.make(elements);
      const double begun = user_seconds();
      const beams::BeamSolution solution = find_equilibrium(BeamStructure(model));
      const double solved = user_seconds();
      const int repeats = options.quick ? 1 : options.repeats;
      beams::DiscretisationEstimate estimate;
      for (int i = 0; i < repeats; ++i)
        estimate = estimate_discretisation(model, {Subdivision::even(model, 1), solution.state});
      const double estimated = user_seconds();
      Case result;
      result["case"] = known.name;
      add_error(estimate.error, result);
      add_truth(model, solution.state, solution.report.elastic_energy, result);
      result["solve_ms"] = 1e3 * (solved - begun);
      result["estimate_ms"] = 1e3 * (estimated - solved) / repeats;
      recorder.add(result);
    }
  }
}

/// An equilibrium of a structure whose elements are cut.
struct Level {
  beams::CutEquilibrium cut;
  double energy = 0;
  double seconds = 0;  // that it took
  bool is_found = false;
};

Level solved(const BeamModel& model, const Subdivision& cut, const BeamState& start) {
  const double begun = user_seconds();
  beams::BeamSolution found = find_equilibrium_from(BeamStructure(cut_model(model, cut)), start);
  return {{cut, std::move(found.state)},
          found.report.elastic_energy,
          user_seconds() - begun,
          found.report.converged()};
}

/// Halved three times, each time from the equilibrium before, so that it is the same one.
std::optional<Level> limit_of(const BeamModel& model, const Level& level) {
  Level fine = level;
  for (int i = 0; i < 3; ++i) {
    const Subdivision halves = fine.cut.subdivision.halved(model);
    const BeamStructure structure(cut_model(model, fine.cut.subdivision));
    fine =
        solved(model, halves, carry_state(structure, fine.cut.subdivision, fine.cut.state, halves));
    if (!fine.is_found) return {};
  }
  return fine;
}

/// Against a state of other parts.
void add_distances(const BeamState& a, const BeamState& b, Eigen::Index nodes, Case& result) {
  const Eigen::VectorXd apart = distances(a, b, nodes);
  result["moved"] = apart.maxCoeff();
  result["rms_moved"] = std::sqrt(apart.squaredNorm() / static_cast<double>(nodes));
}

/// The structure as it came and at every level that a tolerance takes; then the same structure
/// solved as drawn with even parts: is it the same equilibrium?
void run_tolerance(const std::string& name, const BeamModel& given, double tolerance,
                   Recorder& recorder) {
  const auto nodes = static_cast<Eigen::Index>(given.nodes.size());
  const BeamModel model = without_temporary_loads(given);
  double begun = user_seconds();
  beams::BeamSolution drawn = find_equilibrium(BeamStructure(given));
  Level level{{Subdivision::even(given, 1), std::move(drawn.state)},
              drawn.report.elastic_energy,
              user_seconds() - begun,
              drawn.report.converged()};
  const BeamState first = level.cut.state;
  while (level.is_found) {
    begun = user_seconds();
    const beams::DiscretisationEstimate estimate = estimate_discretisation(model, level.cut);
    Case result;
    result["case"] = name;
    result["tolerance"] = tolerance;
    result["solve_s"] = level.seconds;
    result["estimate_s"] = user_seconds() - begun;
    add_error(estimate.error, result);
    if (const auto limit = limit_of(model, level)) {
      const double off = distances(level.cut.state, limit->cut.state, nodes).maxCoeff();
      result["true"] = off / structure_size(model);
      result["estimate_over_true"] = estimate.error.max_distance / off;
      result["energy_true"] = std::abs(level.energy - limit->energy) / limit->energy;
    }
    result["energy"] = level.energy;
    add_distances(level.cut.state, first, nodes, result);
    recorder.add(result);
    if (!estimate.error.is_known || estimate.error.position_error <= tolerance) break;
    const auto next = refined_where_needed(model, level.cut.subdivision, estimate.indicators,
                                           beams::kMaxCutElements);
    if (!next) break;
    const beams::CutEquilibrium& finest = *estimate.finest;
    level = solved(model, *next,
                   carry_state(BeamStructure(cut_model(model, finest.subdivision)),
                               finest.subdivision, finest.state, *next));
  }
  for (const int parts : {2, 4}) {
    begun = user_seconds();
    const beams::BeamSolution even =
        find_equilibrium(BeamStructure(cut_model(given, Subdivision::even(given, parts))));
    Case result;
    result["case"] = name + ", drawn with " + std::to_string(parts) + " parts";
    result["solve_s"] = user_seconds() - begun;
    result["limit"] = to_string(even.report.status);
    result["energy"] = even.report.elastic_energy;
    add_distances(even.state, level.cut.state, nodes, result);
    recorder.add(result);
  }
}

}  // namespace

void beam_errors_suite(const SuiteOptions& options, Recorder& recorder) {
  run_known(options, recorder);
  const auto folder = std::filesystem::path(options.shared_folder) / "data" / "beams";
  if (options.shared_folder.empty() || !std::filesystem::exists(folder)) {
    recorder.note("the public structures are left out: no shared folder");
    return;
  }
  for (const char* name : {"cantilever", "pentashell_pinned", "roof", "torus"}) {
    if (!is_selected(name)) continue;
    const BeamModel model = testing::model_of(scene::read_beam_job_folder(folder / name));
    if (options.quick)
      run_tolerance(name, model, 1e-3, recorder);
    else
      for (const double tolerance : {1e-3, 1e-4}) run_tolerance(name, model, tolerance, recorder);
  }
}

}  // namespace limber::bench
