// Space-time solve for z, the paper's own way (LiteralSpacetime) and limber's, side by side in one
// run: same kinematics, same constraints, same start z = 0, same tolerance on the same scale-free
// gradient (kTolerance: energies then agree to 1e-6, as energy_relative_difference shows; where it
// does not, the two ended in different minima and the ratio of times means nothing).
//
// What is timed. cold_ms: tables of the constrained sites, solver, constraints, solve to
// convergence, motion of all frames; nothing that depends on the model alone. literal_cold_ms: the
// same with the literal method. From z = 0 at full weight Gauss-Newton may end in a worse minimum,
// or crawl; then energies cannot be compared. So literal_cold_ms, energy_literal and
// literal_iterations are of whichever is faster of those that reach limber's energy: the literal
// method as printed (literal_start = "zero") or led by the same kind of continuation as limber's
// cold start ("continued", LiteralSpacetime::solve_continued). Both are reported: literal_zero_*,
// literal_continued_*.
//
// Gauss-Newton converges linearly where targets cannot be met; the last digits cost it many steps.
// So that this does not flatter the ratio, *_to_1e-6_ms say when each was within 1e-6 (relative) of
// its own final energy, known only afterwards.
//
// warm_first_ms: one target moved by 2 % of the body's length, correct() and the motion of all
// frames. warm_first_frames_ms: with the reduced coordinates of all frames, ready to stream.
// warm_converged_ms: from the move to convergence, first motion included; cold_default_ms and all
// warm times are at the default tolerance of the solver, which the service uses (1e-8).
#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/samples.h"
#include "engine/session/problem_mapping.h"
#include "engine/spacetime/solver.h"
#include "tests/support/chain_kinematics.h"
#include "tests/support/literal_spacetime.h"

namespace limber::bench {
namespace {

using reduced::ReducedKinematics;
using reduced::ReducedModel;
using spacetime::PositionConstraint;
using spacetime::Solver;

/// Gauss-Newton needs thousands of steps for the solver's default of 1e-8, if rounding lets it get
/// there at all; a tighter tolerance would only count those.
constexpr double kTolerance = 1e-4;

/// A constraint before sites are known to any kinematics.
struct NodeConstraint {
  std::vector<int> nodes;  // compact
  PositionConstraint constraint;
};

struct Problem {
  std::string scene;
  int tets = 0;
  std::shared_ptr<const ReducedModel> model;
  spacetime::ModeDynamics dynamics;
  spacetime::Timeline timeline;
  std::vector<NodeConstraint> constraints;
};

/// What the constraints add to a model: site tables, and the constraints in their terms.
struct Prepared {
  std::shared_ptr<ReducedKinematics> kinematics;
  std::vector<PositionConstraint> constraints;
};

std::shared_ptr<ReducedKinematics> without_sites(const Problem& problem) {
  return std::make_shared<ReducedKinematics>(problem.model);
}

Prepared prepare(const Problem& problem, std::shared_ptr<ReducedKinematics> kinematics) {
  Prepared prepared{std::move(kinematics), {}};
  for (const NodeConstraint& item : problem.constraints) {
    prepared.constraints.push_back(item.constraint);
    prepared.constraints.back().site = prepared.kinematics->add_site(item.nodes);
  }
  return prepared;
}

std::shared_ptr<const ReducedModel> build(const bodies::ElasticBody& body, int modes, int basis,
                                          int cubature) {
  reduced::ModelOptions options;
  options.mode_count = modes;
  options.basis_size = basis;
  options.cubature_size = cubature;
  return std::make_shared<const ReducedModel>(reduced::build_model(body, options));
}

Problem flower(Recorder& recorder) {
  const scene::Scene scene = scene::make_sample("flower");
  const session::MappedBody mapped = session::map_body(scene);
  recorder.note("spacetime: building the flower's model");
  Problem problem;
  problem.scene = "flower";
  problem.tets = mapped.body.mesh.tet_count();
  problem.model = build(mapped.body, 30, 80, 32);
  problem.dynamics =
      session::map_dynamics(scene.dynamics, problem.model->eigenvalues, problem.model->rigid_count);
  problem.timeline = {scene.frame_count, session::map_end(scene.first_end),
                      session::map_end(scene.last_end)};
  const session::TargetFrame frame(scene, mapped);
  for (const scene::Constraint& item : scene.constraints) {
    NodeConstraint result{frame.compact_nodes(item.nodes), {}};
    result.constraint.id = problem.constraints.size() + 1;
    result.constraint.frame = item.frame;
    result.constraint.axes = item.axes;
    result.constraint.weight = item.weight;
    result.constraint.target =
        frame.displacement(item.target, frame.origin(item.kind, result.nodes));
    problem.constraints.push_back(result);
  }
  return problem;
}

/// Nodes that swing far and lie apart (head, hands, tail), by farthest-point sampling of what the
/// first modes move.
std::vector<int> outer_nodes(const bodies::ElasticBody& body, const ReducedModel& model,
                             int count) {
  const auto nodes = static_cast<Eigen::Index>(model.node_count);
  Eigen::VectorXd swing = Eigen::VectorXd::Zero(nodes);
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(6, model.modes.cols()); ++k) {
    for (Eigen::Index i = 0; i < nodes; ++i)
      swing[i] += model.modes.col(k).segment<3>(3 * i).squaredNorm();
  }
  std::vector<int> chosen;
  Eigen::VectorXd distance = Eigen::VectorXd::Ones(nodes);
  for (int i = 0; i < count; ++i) {
    Eigen::Index best = 0;
    swing.cwiseProduct(distance).maxCoeff(&best);
    const Eigen::RowVectorXd apart =
        (body.mesh.nodes.colwise() - Eigen::Vector3d(body.mesh.nodes.col(best)))
            .colwise()
            .squaredNorm();
    distance =
        i == 0 ? Eigen::VectorXd(apart) : Eigen::VectorXd(distance.cwiseMin(apart.transpose()));
    chosen.push_back(static_cast<int>(best));
  }
  return chosen;
}

/// 27 constraints on three nodes in turn, on the path of a random smooth motion of the model's own
/// modes (largest displacement near a quarter of the body), each off it by up to 0.3 % of the body.
std::optional<Problem> tyrannosaurus(const SuiteOptions& options, Recorder& recorder) {
  constexpr int kFrames = 350, kModes = 30, kConstraints = 27, kMoved = 8;
  const std::optional<NamedBody> named = load_body("tyrannosaurus", options);
  if (!named) return std::nullopt;
  recorder.note("spacetime: building the tyrannosaurus' model");
  Problem problem;
  problem.scene = "tyrannosaurus";
  problem.tets = named->body.mesh.tet_count();
  problem.model = build(named->body, kModes, 80, 32);
  scene::Dynamics dynamics;
  dynamics.period_frames = 60;
  problem.dynamics = session::map_dynamics(dynamics, problem.model->eigenvalues, 0);
  problem.timeline.frame_count = kFrames;
  const std::vector<int> nodes = outer_nodes(named->body, *problem.model, 3);

  std::mt19937_64 generator(2014);
  Eigen::MatrixXd amplitude(kMoved, 4);
  for (auto& value : amplitude.reshaped()) value = testing::uniform(generator);
  std::vector<int> frames;
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(kModes, kConstraints);
  for (int i = 0; i < kConstraints; ++i) {
    frames.push_back(25 + 300 * i / (kConstraints - 1));
    const double time = static_cast<double>(frames.back()) / (kFrames - 1);
    for (int k = 0; k < kMoved; ++k) {
      for (int wave = 0; wave < amplitude.cols(); ++wave) {
        z(k, i) += amplitude(k, wave) / (1 + 0.5 * k) / (wave + 1) *
                   std::sin(std::numbers::pi * (wave + 1) * time);
      }
    }
  }
  ReducedKinematics kinematics(problem.model);
  std::vector<reduced::SiteQuery> queries;
  for (int i = 0; i < kConstraints; ++i)
    queries.push_back({kinematics.add_site({nodes[static_cast<std::size_t>(i % 3)]}), i});
  Eigen::Matrix3Xd u;
  kinematics.evaluate(frames, z, queries, u, nullptr);
  const double scale =
      0.25 * problem.model->length / u.colwise().norm().maxCoeff();  // about: u is nearly linear
  z *= scale;
  kinematics.evaluate(frames, z, queries, u, nullptr);
  for (int i = 0; i < kConstraints; ++i) {
    NodeConstraint item{{nodes[static_cast<std::size_t>(i % 3)]}, {}};
    item.constraint.id = static_cast<spacetime::ConstraintId>(i + 1);
    item.constraint.frame = frames[static_cast<std::size_t>(i)];
    const Eigen::Vector3d off(testing::uniform(generator), testing::uniform(generator),
                              testing::uniform(generator));
    item.constraint.target = u.col(i) + 0.003 * problem.model->length * off;
    problem.constraints.push_back(item);
  }
  return problem;
}

std::unique_ptr<Solver> make_solver(const Problem& problem, const Prepared& prepared,
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

Cold run_cold(const Problem& problem, double tolerance, int repeats) {
  spacetime::SolverOptions options;
  options.gradient_tolerance = tolerance;
  Cold cold;
  for (int i = 0; i < repeats; ++i) {
    auto kinematics = without_sites(problem);
    cold.times.push_back(milliseconds([&] {
      const Prepared prepared = prepare(problem, kinematics);
      const auto solver = make_solver(problem, prepared, options);
      cold.report = solver->solve();
      static_cast<void>(solver->motion());
    }));
    // Once more with a clock in the callback, so that the clock is not in the time above.
    kinematics = without_sites(problem);
    std::vector<double> energies, when;
    const auto start = std::chrono::steady_clock::now();
    const Prepared prepared = prepare(problem, kinematics);
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

Literal run_literal(const Problem& problem, LiteralStart start, int repeats) {
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
        const Prepared prepared = prepare(problem, kinematics);
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

/// Moves the constraints in turn to 2 % of the body's length beside their first targets.
Warm run_warm(const Problem& problem, int moves) {
  const Prepared prepared = prepare(problem, without_sites(problem));
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

void run(const Problem& problem, const SuiteOptions& options, Recorder& recorder) {
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
  result["literal_zero_ms"] = median(zero.times);
  result["literal_zero_energy"] = zero.result.total_energy;
  result["literal_zero_iterations"] = zero.result.iterations;
  result["literal_continued_ms"] = median(continued.times);
  result["literal_continued_energy"] = continued.result.total_energy;
  result["literal_continued_iterations"] = continued.result.iterations;
  result["cold_iterations"] = cold.report.iterations;
  result["cold_converged"] = cold.report.status == spacetime::SolveStatus::kConverged;
  result["warm_iterations"] = median(warm.iterations);
  result["warm_moves"] = warm.first.size();
  result["warm_not_converged"] = warm.not_converged;
  result["warm_energy_against_cold"] = warm.cold_energy_difference;
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
  run(flower(recorder), options, recorder);
  if (const auto problem = tyrannosaurus(options, recorder)) {
    run(*problem, options, recorder);
  } else {
    recorder.note("spacetime: tyrannosaurus left out, the public data is not there");
  }
}

}  // namespace limber::bench
