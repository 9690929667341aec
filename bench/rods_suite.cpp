// Single rods: error against known answers by number of edges, with time, and times of the kernels.

#include <cmath>
#include <map>

#include "bench/rod_kernels.h"
#include "bench/suite.h"
#include "tests/support/rod_problems.h"

namespace limber::bench {

namespace {

using testing::Ends;
using testing::RodAnswer;

struct Problem {
  const char* name;
  std::function<RodAnswer(int, rods::BendingForm)> run;
  std::vector<int> edges;
};

std::vector<Problem> problems() {
  const std::vector<int> usual{5, 10, 20, 40, 80};
  return {
      {"cantilever, alpha 1",
       [](int n, rods::BendingForm f) { return testing::cantilever(n, 1, .30172, .05643, 1e4, f); },
       usual},
      {"cantilever, alpha 10",
       [](int n, rods::BendingForm f) {
         return testing::cantilever(n, 10, .81061, .55500, 1e4, f);
       },
       usual},
      {"roll-up to a circle", testing::roll_up, usual},
      {"elastica, hinged, span .3",
       [](int n, rods::BendingForm f) {
         return testing::compressed(n, Ends::kHinged, .3, .399731, f);
       },
       usual},
      {"elastica, clamped, span .3",
       [](int n, rods::BendingForm f) {
         return testing::compressed(n, Ends::kClamped, .3, .399731, f);
       },
       usual},
      {"45 degree bend, F 300, J 1/6",
       [](int n, rods::BendingForm f) {
         return testing::forty_five_degree_bend(n, 300, 1.0 / 6, {58.780, 22.245, 40.189}, f);
       },
       usual},
      {"45 degree bend, F 600, J 1/6",
       [](int n, rods::BendingForm f) {
         return testing::forty_five_degree_bend(n, 600, 1.0 / 6, {47.152, 15.685, 53.472}, f);
       },
       usual},
      {"45 degree bend, F 600, J .1406",
       [](int n, rods::BendingForm f) {
         return testing::forty_five_degree_bend(n, 600, .1406, {46.894, 15.558, 53.604}, f);
       },
       usual},
      {"localised helix, 27 turns", testing::localised_helix, {40, 80, 160, 320, 640, 1280}},
      {"twisted ring's threshold", testing::ring_threshold, usual},
  };
}

/// One problem at all its subdivisions in one form of bending.
void run_problem(const Problem& problem, const char* form_name, rods::BendingForm form,
                 const SuiteOptions& options, Recorder& recorder) {
  double previous = 0, previous_value = 0;
  int previous_edges = 0;
  for (const int edges : problem.edges) {
    if (options.quick && edges > 320) {
      recorder.note(std::string("--quick leaves out ") + problem.name + " at " +
                    std::to_string(edges) + " edges");
      continue;
    }
    RodAnswer answer;
    std::vector<double> times;
    for (int i = 0; i < (edges > 320 ? 1 : options.repeats); ++i)
      times.push_back(milliseconds([&] { answer = problem.run(edges, form); }));
    Case result;
    result["problem"] = problem.name;
    result["form"] = form_name;
    result["edges"] = edges;
    result["value"] = answer.value;
    result["expected"] = answer.expected;
    result["error_percent"] = 100 * answer.error;
    result["order"] = nullptr;
    result["extrapolated_error_percent"] = nullptr;
    // Extrapolation of the last two discretisations, if the error goes as the square of the edges'
    // length.
    const double ratio = previous_edges > 0 ? double(edges) / previous_edges : 0;
    if (previous_edges > 0) {
      result["order"] = std::log(previous / answer.error) / std::log(ratio);
      const double best = answer.value + (answer.value - previous_value) / (ratio * ratio - 1);
      result["extrapolated_error_percent"] = 100 * std::abs(best - answer.expected) /
                                             (answer.expected == 0 ? 1 : std::abs(answer.expected));
    }
    result["iterations"] = answer.report.iterations;
    result["ms"] = median(times);
    recorder.add(result);
    previous = answer.error;
    previous_value = answer.value;
    previous_edges = edges;
  }
}

}  // namespace

void rods_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const Problem& problem : problems()) {
    run_problem(problem, "2008", rods::BendingForm::kMaterialFrames, options, recorder);
    run_problem(problem, "2010", rods::BendingForm::kAveragedFrames, options, recorder);
    run_problem(problem, "turning angle", rods::BendingForm::kTurningAngle, options, recorder);
  }
  const RodKernelTimes t = time_rod_kernels(1532, options.quick ? 20 : 100);
  for (const auto& [name, value] : std::vector<std::pair<const char*, double>>{
           {"element gradient, scalar", t.element_gradient_scalar},
           {"element gradient, pack", t.element_gradient_pack},
           {"element Hessian, scalar", t.element_hessian_scalar},
           {"element Hessian, pack", t.element_hessian_pack},
           {"frames and twists", t.state},
           {"energies and gradient", t.gradient},
           {"source moved", t.rebase},
           {"Hessian", t.hessian},
           {"Hessian-vector product", t.hessian_vector_product},
           {"third derivatives", t.third_derivatives}}) {
    Case result;
    result["problem"] = name;
    result["ns_per_vertex"] = value;
    recorder.add(result);
  }
}

}  // namespace limber::bench
