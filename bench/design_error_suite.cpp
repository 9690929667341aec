// Time against error of designs, by CPU time of the one thread. The error is the distance of joints
// from a target that is known to be reachable, after each step of a search on burd that came
// nearer. Its value `distance` is the root mean square, in parts of the initial one. The knob is
// when to stop. `limber` guards the flat shape against buckling from the start; `limber, no guard`
// refuses trials that lose it and is the plain alternative.
#include <fmt/core.h>

#include "bench/design_trace.h"
#include "bench/known_designs.h"
#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/parallel.h"

namespace limber::bench {
namespace {

void trace_design(const DesignProblem& problem, const KnownDesign& known, rods::BucklingGuard guard,
                  const char* method, int steps, Recorder& recorder) {
  rods::LinkageDesign design = design_towards(known, problem);
  rods::DesignOptimizerOptions search = known_search(design, steps);
  search.guard = guard;
  DesignTrace trace(design, search);
  double begun = 0, nearest = 0;
  const auto add = [&](int iteration, const rods::DesignValues& values) {
    const double distance = trace.distance(values);
    if (begun == 0) begun = nearest = distance;
    if (iteration > 0 && distance >= nearest) return;
    nearest = distance;
    Case row;
    row["model"] = "burd";
    row["method"] = method;
    row["step"] = iteration;
    row["cpu_ms"] = 1e3 * trace.seconds();
    row["distance"] = distance / begun;
    recorder.add(row);
  };
  const rods::DesignReport report = rods::optimize_design(
      design, search, {}, [&](const rods::DesignProgress& progress, rods::LinkageDesign& at) {
        if (progress.iteration == 1) add(0, at.values(problem.start));
        add(progress.iteration, progress.values);
      });
  recorder.note(fmt::format("design_error: {}: {} steps, {} trials not believed", method,
                            report.iterations, report.not_believed));
}

}  // namespace

void design_error_suite(const SuiteOptions& options, Recorder& recorder) {
  const int before = thread_count();
  set_thread_count(1);
  for_each_design(options, recorder, [&](const LinkageCase& named, const std::string& path) {
    if (std::string_view(named.name) != "burd") return;
    const DesignProblem problem = open_design(named, path);
    const KnownDesign known = known_design(problem, kPerturbed);
    const int steps = options.quick ? 60 : 200;
    trace_design(problem, known, rods::BucklingGuard::kFromStart, "limber", steps, recorder);
    trace_design(problem, known, rods::BucklingGuard::kNever, "limber, no guard", steps, recorder);
  });
  set_thread_count(before);
}

}  // namespace limber::bench
