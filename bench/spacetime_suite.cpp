// Space-time solve for z, the paper's own method (LiteralSpacetime) and limber's, side by side in
// one run. They have the same kinematics, constraints, start z = 0, and tolerance on the same
// scale-free gradient (kTolerance). Energies then agree to 1e-6, as energy_relative_difference
// shows; if they do not, the two ended in different minima and the ratio of times means nothing.
//
// Timed parts: `cold_ms`: tables of the constrained sites, solver, constraints, solve to
// convergence, motion of all frames; nothing that depends on the model alone. `literal_cold_ms`:
// the same with the literal method. From z = 0 at full weight Gauss-Newton may end in a worse
// minimum, or crawl; then energies cannot be compared. Therefore literal_cold_ms, energy_literal
// and literal_iterations are of the fastest literal run that reaches limber's energy. The literal
// method runs as printed (literal_start = "zero") or led by the same kind of continuation as
// limber's cold start ("continued", LiteralSpacetime::solve_continued). Both are reported:
// literal_zero_*, literal_continued_*.
//
// Gauss-Newton converges linearly where targets cannot be met; the last digits cost it many steps.
// The ratio would benefit from that; therefore *_to_1e-6_ms are the times when each was within 1e-6
// (relative) of its own final energy, known only afterwards.
//
// `warm_first_ms`: one target moved by 2 % of the body's length, correct() and the motion of all
// frames. `warm_first_frames_ms`: with the reduced coordinates of all frames, ready to stream.
// `warm_converged_ms`: from the move to convergence, first motion included. `cold_default_ms` and
// all warm times are at the default tolerance of the solver, which the service uses (1e-8).
//
// Last, sessions of long scenes (bench/long_scenes.h). $LIMBER_BENCH_ONLY: only parts whose names
// contain it, of "flower", "tyrannosaurus" and "long scenes".
#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "bench/long_scenes.h"
#include "bench/spacetime_problems.h"
#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"
#include "engine/spacetime/solver.h"
#include "tests/support/literal_spacetime.h"

namespace limber::bench {
namespace {

using reduced::ReducedKinematics;
using spacetime::PositionConstraint;
using spacetime::Solver;

/// Gauss-Newton needs thousands of steps for the solver's default of 1e-8, if rounding lets it get
/// there at all; a tighter tolerance would only count those.
constexpr double kTolerance = 1e-4;

/// Additions of the constraints to a model: site tables, and the constraints in their terms.
struct PreparedSites {
  std::shared_ptr<ReducedKinematics> kinematics;
  std::vector<PositionConstraint> constraints;
};

std::shared_ptr<ReducedKinematics> without_sites(const SpacetimeProblem& problem) {
  return std::make_shared<ReducedKinematics>(problem.model);
}

PreparedSites prepare(const SpacetimeProblem& problem,
                      std::shared_ptr<ReducedKinematics> kinematics) {
  PreparedSites prepared{std::move(kinematics), {}};
  prepared.constraints = place_constraints(problem, *prepared.kinematics);
  return prepared;
}

std::unique_ptr<Solver> make_solver(const SpacetimeProblem& problem, const PreparedSites& prepared,
                                    const spacetime::SolverOptions& options) {
  auto solver =
      std::make_unique<Solver>(prepared.kinematics, problem.dynamics, problem.timeline, options);
  for (const PositionConstraint& constraint : prepared.constraints) solver->add(constraint);
  return solver;
}

struct Cold {
  std::vector<double> times, to_1e6;
  spacetime::SolveReport report;
};

Cold run_cold(const SpacetimeProblem& problem, double tolerance, int repeats) {
  spacetime::SolverOptions options;
  options.gradient_tolerance = tolerance;
  Cold cold;
  for (int i = 0; i < repeats; ++i) {
    auto kinematics = without_sites(problem);
    cold.times.push_back(milliseconds([&] {
      const PreparedSites prepared = prepare(problem, kinematics);
      const auto solver = make_solver(problem, prepared, options);
      cold.report = solver->solve();
      static_cast<void>(solver->motion());
    }));
    // Once more with a clock in the callback, so that the clock is not in the time above.
    kinematics = without_sites(problem);
    std::vector<double> energies, when;
    const auto start = std::chrono::steady_clock::now();
    const PreparedSites prepared = prepare(problem, kinematics);
    const auto solver = make_solver(problem, prepared, options);
    solver->solve({}, [&](const spacetime::SolveReport& report) {
      const std::chrono::duration<double, std::milli> since =
          std::chrono::steady_clock::now() - start;
      energies.push_back(report.total_energy);
      when.push_back(since.count());
      return true;
    });
    for (std::size_t k = 0; k < energies.size(); ++k) {
      if (std::abs(energies[k] - cold.report.total_energy) > 1e-6 * cold.report.total_energy)
        continue;
      cold.to_1e6.push_back(when[k]);
      break;
    }
  }
  return cold;
}

enum class LiteralStart { kZero, kContinued };

struct Literal {
  std::vector<double> times, to_1e6;
  testing::LiteralResult result;
};

Literal run_literal(const SpacetimeProblem& problem, LiteralStart start, int repeats) {
  spacetime::SolverOptions options;
  options.gradient_tolerance = kTolerance;
  options.max_iterations = 1000;
  Literal literal;
  for (int i = 0; i < repeats; ++i) {
    double before = 0;
    const auto kinematics = without_sites(problem);
    const double all = milliseconds([&] {
      std::unique_ptr<testing::LiteralSpacetime> method;
      before = milliseconds([&] {
        const PreparedSites prepared = prepare(problem, kinematics);
        method = std::make_unique<testing::LiteralSpacetime>(
            prepared.kinematics, problem.dynamics, problem.timeline, prepared.constraints, options);
      });
      literal.result =
          start == LiteralStart::kZero ? method->solve_cold() : method->solve_continued();
    });
    literal.times.push_back(all);
    const auto& energies = literal.result.energies;
    const double final_energy = literal.result.total_energy;
    for (std::size_t k = 0; k < energies.size(); ++k) {
      if (energies[k] > (1 + 1e-6) * final_energy) continue;
      literal.to_1e6.push_back(before + literal.result.milliseconds[k]);
      break;
    }
  }
  return literal;
}

struct Warm {
  std::vector<double> first, first_frames, converged, iterations;
  int not_converged = 0;
  double cold_energy_difference = 0;  // after the last move, against a new solver's, relative
};

/// Moves the constraints in turn to 2 % of the body's length from their first targets.
Warm run_warm(const SpacetimeProblem& problem, int moves) {
  const PreparedSites prepared = prepare(problem, without_sites(problem));
  const auto solver = make_solver(problem, prepared, {});
  solver->solve();
  Warm warm;
  Eigen::MatrixXf coordinates;
  spacetime::SolveReport report;
  constexpr int kNotCounted = 3;
  for (int i = 0; i < kNotCounted + moves; ++i) {
    const auto& constraint =
        prepared.constraints[static_cast<std::size_t>(i * 7) % prepared.constraints.size()];
    const double angle = 2 * std::numbers::pi * 0.618034 * i;
    const double height = std::sin(1.3 * i);
    const Eigen::Vector3d direction(std::sqrt(1 - height * height) * std::cos(angle), height,
                                    std::sqrt(1 - height * height) * std::sin(angle));
    const Eigen::Vector3d target =
        constraint.target + 0.02 * prepared.kinematics->length() * direction;
    const double first = milliseconds([&] {
      solver->move(constraint.id, target);
      solver->correct();
      static_cast<void>(solver->motion());
    });
    const double frames =
        milliseconds([&] { prepared.kinematics->coordinates(0, solver->motion(), coordinates); });
    const double rest = milliseconds([&] {
      report = solver->solve();
      static_cast<void>(solver->motion());
    });
    if (i < kNotCounted) continue;
    warm.first.push_back(first);
    warm.first_frames.push_back(first + frames);
    warm.converged.push_back(first + rest);
    warm.iterations.push_back(report.iterations);
    if (report.status != spacetime::SolveStatus::kConverged) ++warm.not_converged;
  }
  Solver fresh(prepared.kinematics, problem.dynamics, problem.timeline);
  for (const PositionConstraint& constraint : solver->constraints()) fresh.add(constraint);
  const double energy = fresh.solve().total_energy;
  warm.cold_energy_difference = (report.total_energy - energy) / energy;
  return warm;
}

Case describe(const SpacetimeProblem& problem) {
  Case result;
  result["scene"] = problem.scene;
  result["tets"] = problem.tets;
  result["modes"] = problem.dynamics.stiffness.size();
  result["frames"] = problem.timeline.frame_count;
  result["constraints"] = problem.constraints.size();
  result["weight"] = problem.constraints.front().constraint.weight;
  result["basis"] = problem.model->basis_size();
  result["cubature_tets"] = problem.model->cubature_size();
  result["model_error"] = problem.model->report.error_mean;
  return result;
}

void add_literal(Case& result, const std::string& prefix, const Literal& literal) {
  result[prefix + "_ms"] = median(literal.times);
  result[prefix + "_energy"] = literal.result.total_energy;
  result[prefix + "_iterations"] = literal.result.iterations;
}

/// Iterations of the warm solves, with their times.
void add_warm(Case& result, const Warm& warm) {
  result["warm_iterations"] = median(warm.iterations);
  result["warm_moves"] = warm.first.size();
  result["warm_not_converged"] = warm.not_converged;
  result["warm_energy_against_cold"] = warm.cold_energy_difference;
}

void run_spacetime(const SpacetimeProblem& problem, const SuiteOptions& options,
                   Recorder& recorder) {
  recorder.note("spacetime: " + problem.scene + ", cold");
  const int repeats = options.quick ? 3 : options.repeats;
  const Cold cold = run_cold(problem, kTolerance, repeats);
  const Cold cold_default =
      run_cold(problem, spacetime::SolverOptions{}.gradient_tolerance, repeats);
  recorder.note("spacetime: " + problem.scene + ", warm");
  const Warm warm = run_warm(problem, options.quick ? 15 : 60);
  recorder.note("spacetime: " + problem.scene + ", literal");
  const int literal_repeats = options.quick ? 1 : std::min(3, options.repeats);
  const Literal zero = run_literal(problem, LiteralStart::kZero, literal_repeats);
  const Literal continued = run_literal(problem, LiteralStart::kContinued, literal_repeats);

  const double energy = cold.report.total_energy;
  const auto difference = [&](const Literal& literal) {
    return std::abs(energy - literal.result.total_energy) / literal.result.total_energy;
  };
  const bool zero_counts =
      difference(zero) <= 1e-6 &&
      (difference(continued) > 1e-6 || median(zero.times) <= median(continued.times));
  const Literal& literal = zero_counts ? zero : continued;
  Case result = describe(problem);
  result["literal_cold_ms"] = median(literal.times);
  result["cold_ms"] = median(cold.times);
  result["warm_first_ms"] = median(warm.first);
  result["warm_first_p99_ms"] = quantile(warm.first, 0.99);
  result["warm_first_frames_ms"] = median(warm.first_frames);
  result["warm_converged_ms"] = median(warm.converged);
  result["warm_converged_p99_ms"] = quantile(warm.converged, 0.99);
  result["energy_literal"] = literal.result.total_energy;
  result["energy_ours"] = energy;
  result["energy_relative_difference"] = difference(literal);
  result["speedup_cold"] = median(literal.times) / median(cold.times);
  result["speedup_warm_first"] = median(literal.times) / median(warm.first);
  result["literal_to_1e-6_ms"] = median(literal.to_1e6);
  result["cold_to_1e-6_ms"] = median(cold.to_1e6);
  result["literal_iterations"] = literal.result.iterations;
  result["literal_converged"] = literal.result.converged;
  result["literal_start"] = zero_counts ? "zero" : "continued";
  add_literal(result, "literal_zero", zero);
  add_literal(result, "literal_continued", continued);
  result["cold_iterations"] = cold.report.iterations;
  result["cold_converged"] = cold.report.status == spacetime::SolveStatus::kConverged;
  add_warm(result, warm);
  result["max_constraint_error"] = cold.report.max_constraint_error;
  result["gradient_tolerance"] = kTolerance;
  result["cold_default_ms"] = median(cold_default.times);
  result["cold_default_iterations"] = cold_default.report.iterations;
  result["cold_default_converged"] =
      cold_default.report.status == spacetime::SolveStatus::kConverged;
  result["quick"] = options.quick;
  recorder.add(result);
}

}  // namespace

void spacetime_suite(const SuiteOptions& options, Recorder& recorder) {
  if (is_selected("flower"))
    run_spacetime(sample_problem("flower", 30, recorder), options, recorder);
  if (is_selected("tyrannosaurus")) {
    if (const auto problem = tyrannosaurus_problem(30, options, recorder)) {
      run_spacetime(*problem, options, recorder);
    } else {
      recorder.note("spacetime: tyrannosaurus left out, the public data is not there");
    }
  }
  if (is_selected("long scenes")) run_long_scenes(options, recorder);
}

}  // namespace limber::bench
