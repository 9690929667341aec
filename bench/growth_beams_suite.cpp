// Growth of times of beam structures with elements. Rows as those of growth_bodies, by Newton's
// method, and steps of the relaxation. The structures are grids of rods of 100 mm under their own
// weight, clamped along the rim (tests/support/beam_grid.h), and a cantilever cut into ever more
// elements.
#include <fmt/core.h>

#include "bench/growth_rows.h"
#include "bench/suite.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/solver/relaxation.h"
#include "tests/support/beam_grid.h"
#include "tests/support/beam_problems.h"

namespace limber::bench {
namespace {

void grow_beams(const beams::BeamModel& model, const char* shape, const SuiteOptions& options,
                Recorder& recorder) {
  const beams::BeamStructure structure(model);
  recorder.note(fmt::format("growth_beams: {} of {} elements", shape, structure.elements()));
  beams::BeamSolveOptions newton;
  newton.method = beams::BeamMethod::kNewton;
  std::vector<double> times;
  int not_converged = 0;
  for (int i = 0; i < std::min(options.repeats, 3); ++i) {
    times.push_back(milliseconds([&] {
      const beams::BeamSolution found = find_equilibrium(structure, newton);
      not_converged += found.report.status == beams::BeamStatus::kConverged ? 0 : 1;
    }));
  }
  const auto add = [&](const char* what, double ms, int failed) {
    recorder.add(
        growth_row("elements", structure.elements(), std::string(shape) + ", " + what, ms, failed));
  };
  add("equilibrium", median(times), not_converged);
  constexpr int kSteps = 100;
  beams::detail::Relaxation relaxation(structure, structure.rest_state());
  relaxation.set_loads(beams::NodeLoads::of(structure.model()));
  times.clear();
  for (int i = 0; i < options.repeats; ++i) {
    times.push_back(milliseconds([&] {
                      for (int step = 0; step < kSteps; ++step) relaxation.step();
                    }) /
                    kSteps);
  }
  add("step of the relaxation", median(times), 0);
}

}  // namespace

void growth_beams_suite(const SuiteOptions& options, Recorder& recorder) {
  using Held = testing::BeamGrid::Held;
  for (const int nodes : {11, 21, 41, 71})
    grow_beams(testing::beam_grid({nodes, 20, 0.1, Held::kRimClamped}), "grid", options, recorder);
  for (const int elements : {10, 40, 160, 640})
    grow_beams(testing::cantilever_model(elements, 1), "cantilever", options, recorder);
}

}  // namespace limber::bench
