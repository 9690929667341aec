// Time against error of the space-time solve for z. Limber's solver starts cold from nothing at
// several tolerances (our knob). The paper's method as written runs at the same ones, from z = 0
// and led through rising weights (tests/support/literal_spacetime.h). `ms`: tables of the
// constrained sites, solver, constraints, solve; medians. `error`: energy above the least that was
// found, in parts of that; below 1e-15 it is rounding. A run that ends in another minimum keeps an
// error that no tolerance removes.
#include <fmt/core.h>

#include <algorithm>

#include "bench/spacetime_problems.h"
#include "bench/suite.h"
#include "engine/spacetime/solver.h"
#include "tests/support/literal_spacetime.h"

namespace limber::bench {
namespace {

class SpacetimeErrors {
 public:
  SpacetimeErrors(const SpacetimeProblem& problem, const SuiteOptions& options, Recorder& recorder)
      : problem_(problem), options_(options), recorder_(recorder) {}

  void run() {
    constexpr double kReference = 1e-12;
    double least = ours(kReference, 1).energy;
    std::vector<Case> rows;
    const auto add = [&](const char* method, double tolerance, const Solved& solved) {
      least = std::min(least, solved.energy);
      Case row;
      row["scene"] = problem_.scene;
      row["method"] = method;
      row["tolerance"] = tolerance;
      row["ms"] = solved.ms;
      row["energy"] = solved.energy;
      row["iterations"] = solved.iterations;
      row["converged"] = solved.is_converged;
      rows.push_back(row);
    };
    for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10}) {
      recorder_.note(fmt::format("spacetime_error: {}, {}", problem_.scene, tolerance));
      add("limber", tolerance, ours(tolerance, options_.repeats));
      if (tolerance < 1e-5) continue;  // Gauss-Newton would need thousands of steps
      add("paper, from zero", tolerance, literal(tolerance, Start::kZero));
      add("paper, rising weights", tolerance, literal(tolerance, Start::kContinued));
    }
    for (Case& row : rows) {
      row["error"] = std::max(1e-16, row["energy"].get<double>() / least - 1);
      recorder_.add(row);
    }
  }

 private:
  enum class Start { kZero, kContinued };
  struct Solved {
    double ms = 0, energy = 0;
    int iterations = 0;
    bool is_converged = false;
  };

  [[nodiscard]] Solved ours(double tolerance, int repeats) const {
    spacetime::SolverOptions options;
    options.gradient_tolerance = tolerance;
    std::vector<double> times;
    spacetime::SolveReport report;
    for (int i = 0; i < repeats; ++i) {
      const auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem_.model);
      times.push_back(milliseconds([&] {
        const auto constraints = place_constraints(problem_, *kinematics);
        spacetime::Solver solver(kinematics, problem_.dynamics, problem_.timeline, options);
        for (const auto& constraint : constraints) solver.add(constraint);
        report = solver.solve();
      }));
    }
    return {median(times), report.total_energy, report.iterations,
            report.status == spacetime::SolveStatus::kConverged};
  }

  [[nodiscard]] Solved literal(double tolerance, Start start) const {
    spacetime::SolverOptions options;
    options.gradient_tolerance = tolerance;
    options.max_iterations = 1000;
    testing::LiteralResult result;
    const auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem_.model);
    const double ms = milliseconds([&] {
      testing::LiteralSpacetime method(kinematics, problem_.dynamics, problem_.timeline,
                                       place_constraints(problem_, *kinematics), options);
      result = start == Start::kZero ? method.solve_cold() : method.solve_continued();
    });
    return {ms, result.total_energy, result.iterations, result.converged};
  }

  const SpacetimeProblem& problem_;
  const SuiteOptions& options_;
  Recorder& recorder_;
};

}  // namespace

void spacetime_error_suite(const SuiteOptions& options, Recorder& recorder) {
  const SpacetimeProblem flower = sample_problem("flower", 30, recorder);
  SpacetimeErrors(flower, options, recorder).run();
  if (options.quick) return recorder.note("spacetime_error: tyrannosaurus left out by --quick");
  if (const auto problem = tyrannosaurus_problem(30, options, recorder)) {
    SpacetimeErrors(*problem, options, recorder).run();
  } else {
    recorder.note("spacetime_error: tyrannosaurus left out, the public data is not there");
  }
}

}  // namespace limber::bench
