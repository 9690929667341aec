// Material optimisation, the paper's alternation (bench/literal_material.h) and limber's joint
// steps, side by side in one run. They have the same kinematics (R = 80, r = 30, h = 80),
// constraints, mu, initial material (S = (I, 0), D = 0), and bounds of frequencies. The bounds are
// an eighth of the frame rate after ten slow rounds of the alternation, ten slow joint steps.
//
// `literal_ms`: 30 outer rounds from z = 0, the first z led through rising weights. `ours_ms`: a
// cold solve for z, then MaterialSolver with its defaults. `ms_to_literal_energy`: from the same
// start until limber's energy is at or below the literal method's final one, or within 1e-5 of it
// (the same minimum, where no method goes below). `speedup` = literal_ms / ms_to_literal_energy.
// `outer_iterations`: limber's steps in all. Energies are totals, E_f + gamma E_c + mu E_s.
//
// `force_energy_z_only` and `force_energy_all` compare control forces at equal constraint error
// (the paper's figure 7). The constraints' common weight of each is the least power of 2 times the
// default at which no constraint is missed by more than kMissed of the body's length. Both are
// taken with columns of S of unit norm.
//
// high_share, literal_high_share: power of the motion above half the Nyquist frequency
// (spacetime::high_frequency_share).
//
// `live_first_ms`: a session that has optimised all, one target moved by 2 % of the body. Time
// until the first motion with a material optimised for it (not just the material of before) is
// there, frames ready to stream.
#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "bench/literal_material.h"
#include "bench/spacetime_problems.h"
#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/motion_spectrum.h"

namespace limber::bench {
namespace {

using reduced::ReducedKinematics;
using spacetime::Material;
using spacetime::MaterialOptions;
using spacetime::MaterialReport;
using spacetime::MaterialSolver;
using spacetime::MaterialVariables;
using spacetime::PositionConstraint;
using spacetime::Solver;

constexpr int kCoordinates = 80;  // R, as in the paper's table 1
constexpr double kMissed = 1e-3;
constexpr double kSameEnergy = 1e-5;  // relative

struct PreparedMaterial {
  std::shared_ptr<ReducedKinematics> kinematics;
  std::vector<PositionConstraint> constraints;
  Material material;  // as it starts
  double slow_frequency = 0;
};

PreparedMaterial prepare(const SpacetimeProblem& problem) {
  PreparedMaterial prepared{std::make_shared<ReducedKinematics>(problem.model), {}, {}, 0};
  prepared.constraints = place_constraints(problem, *prepared.kinematics);
  prepared.material = {problem.dynamics, spacetime::first_coordinates(
                                             problem.model->coordinate_count(),
                                             static_cast<int>(problem.dynamics.stiffness.size()))};
  prepared.slow_frequency = spacetime::slow_frequency_of(
      problem.dynamics,
      reduced::reference_mode(problem.model->coordinate_count(), problem.model->rigid_count,
                              problem.model->mechanism_count));
  return prepared;
}

MaterialOptions options_of(const PreparedMaterial& prepared, MaterialVariables variables) {
  MaterialOptions options;
  options.variables = variables;
  options.slow_frequency = prepared.slow_frequency;
  return options;
}

Solver z_solver(const SpacetimeProblem& problem, const PreparedMaterial& prepared,
                const Material& material) {
  Solver solver(prepared.kinematics, material.dynamics, problem.timeline, {}, material.mixing);
  for (const PositionConstraint& constraint : prepared.constraints) solver.add(constraint);
  return solver;
}

double high_share(const SpacetimeProblem& problem, const Material& material,
                  const Eigen::MatrixXd& motion) {
  const Eigen::VectorXd sizes = problem.model->modes.colwise().norm();
  return spacetime::high_frequency_share(sizes.asDiagonal() * (material.mixing * motion))
      .value_or(0);
}

struct Ours {
  std::vector<double> times, to_literal;
  MaterialReport report;
  double high_share = 0;
};

/// @param target  energy that `to_literal` waits for
Ours run_ours(const SpacetimeProblem& problem, const PreparedMaterial& prepared,
              MaterialVariables variables, double target, int repeats) {
  Ours ours;
  const MaterialOptions options = options_of(prepared, variables);
  for (int i = 0; i < repeats; ++i) {
    double reached = -1;
    const auto start = std::chrono::steady_clock::now();
    const auto since = [&] {
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
          .count();
    };
    Solver solver = z_solver(problem, prepared, prepared.material);
    if (solver.solve().total_energy <= target) reached = since();
    MaterialSolver material(prepared.kinematics, problem.timeline, solver.constraint_set(),
                            prepared.material, solver.motion(), options);
    ours.report = material.solve({}, [&](const MaterialReport& report) {
      if (reached < 0 && report.total_energy <= target) reached = since();
      return true;
    });
    static_cast<void>(material.motion());
    ours.times.push_back(since());
    ours.high_share = high_share(problem, material.material(), material.motion());
    if (reached >= 0) ours.to_literal.push_back(reached);
  }
  return ours;
}

/// Control forces and largest miss (body lengths) where no constraint is missed by more than
/// kMissed.
struct AtEqualError {
  double force_energy = 0, miss = 0, weight = 0;
};

AtEqualError at_equal_error(const SpacetimeProblem& problem, PreparedMaterial prepared,
                            MaterialVariables variables) {
  AtEqualError found;
  const double length = problem.model->length;
  for (double scale = 1.0 / 1024; scale <= 1e6; scale *= 2) {
    for (std::size_t i = 0; i < prepared.constraints.size(); ++i)
      prepared.constraints[i].weight = scale * problem.constraints[i].constraint.weight;
    Solver solver = z_solver(problem, prepared, prepared.material);
    const spacetime::SolveReport z_only = solver.solve();
    found = {z_only.force_energy, z_only.max_constraint_error / length,
             prepared.constraints.front().weight};
    if (variables != MaterialVariables::kMotion) {
      MaterialOptions options = options_of(prepared, variables);
      options.column_weight = 0.01 * prepared.constraints.front().weight;
      MaterialSolver material(prepared.kinematics, problem.timeline, solver.constraint_set(),
                              prepared.material, solver.motion(), options);
      const MaterialReport report = material.solve();
      found.force_energy = report.unit_force_energy;
      found.miss = report.max_constraint_error / length;
    }
    if (found.miss <= kMissed) break;
  }
  return found;
}

struct Live {
  std::vector<double> z_first, material_first;
};

Live run_live(const SpacetimeProblem& problem, const PreparedMaterial& prepared, int moves) {
  Live live;
  Solver solver = z_solver(problem, prepared, prepared.material);
  solver.solve();
  Material material = prepared.material;
  Eigen::MatrixXf coordinates;
  for (int i = 0; i < moves; ++i) {
    if (i > 0) {
      const auto& constraint =
          prepared.constraints[static_cast<std::size_t>(i * 7) % prepared.constraints.size()];
      const double angle = 2.4 * i;
      const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), std::cos(3 * angle));
      solver.move(constraint.id, constraint.target +
                                     0.02 * prepared.kinematics->length() * direction.normalized());
    }
    const auto start = std::chrono::steady_clock::now();
    const auto since = [&] {
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
          .count();
    };
    solver.correct();
    prepared.kinematics->coordinates(0, material.mixing * solver.motion(), coordinates);
    const double first = since();
    solver.solve();
    MaterialOptions options = options_of(prepared, MaterialVariables::kAll);
    if (i > 0) options.slow_steps = 0;  // on from a material that is fitted
    MaterialSolver joint(prepared.kinematics, problem.timeline, solver.constraint_set(), material,
                         solver.motion(), options);
    double material_first = -1;
    joint.solve({}, [&](const MaterialReport&) {
      if (material_first < 0) {
        prepared.kinematics->coordinates(0, joint.material().mixing * joint.motion(), coordinates);
        material_first = since();
      }
      return true;
    });
    material = joint.material();
    solver.set_material(material);
    solver.warm_start(joint.motion(), spacetime::Known::kAnswer);
    solver.solve();
    if (i == 0 || material_first < 0) continue;  // the first is the scene as opened
    live.z_first.push_back(first);
    live.material_first.push_back(material_first);
  }
  return live;
}

void run_material(const SpacetimeProblem& problem, const SuiteOptions& options,
                  Recorder& recorder) {
  const PreparedMaterial prepared = prepare(problem);
  recorder.note("material: " + problem.scene + ", live and at equal error");
  const Live live = run_live(problem, prepared, options.quick ? 4 : 12);
  const AtEqualError z_only = at_equal_error(problem, prepared, MaterialVariables::kMotion);
  const AtEqualError all = at_equal_error(problem, prepared, MaterialVariables::kAll);
  for (const auto& [variables, name] :
       {std::pair{MaterialVariables::kMotionAndDynamics, "z_lambda_d"},
        std::pair{MaterialVariables::kAll, "all"}}) {
    recorder.note(fmt::format("material: {}, {}", problem.scene, name));
    LiteralMaterialOptions literal_options;
    literal_options.variables = variables;
    literal_options.slow_frequency = prepared.slow_frequency;
    const LiteralMaterialResult literal =
        literal_material(prepared.kinematics, problem.timeline, prepared.constraints,
                         prepared.material, literal_options);
    const Ours ours =
        run_ours(problem, prepared, variables, (1 + kSameEnergy) * literal.total_energy,
                 options.quick ? 3 : options.repeats);
    Case result;
    result["scene"] = problem.scene;
    result["mode"] = name;
    result["literal_ms"] = literal.milliseconds.back();
    result["literal_energy"] = literal.total_energy;
    result["ours_ms"] = median(ours.times);
    result["ours_energy"] = ours.report.total_energy;
    result["ms_to_literal_energy"] = median(ours.to_literal);
    result["speedup"] =
        ours.to_literal.empty() ? 0.0 : literal.milliseconds.back() / median(ours.to_literal);
    result["outer_iterations"] = ours.report.iterations;
    result["high_share"] = ours.high_share;
    result["literal_high_share"] = high_share(problem, literal.material, literal.motion);
    result["force_energy_z_only"] = z_only.force_energy;
    result["force_energy_all"] = all.force_energy;
    result["error_z_only"] = z_only.miss;
    result["error_all"] = all.miss;
    result["weight_z_only"] = z_only.weight;
    result["weight_all"] = all.weight;
    result["live_first_ms"] = median(live.material_first);
    result["live_z_first_ms"] = median(live.z_first);
    result["literal_inner_iterations"] = literal.inner_iterations;
    result["evaluations"] = ours.report.evaluations;
    result["settled"] = ours.report.status == spacetime::SolveStatus::kConverged;
    result["modes"] = prepared.material.modes();
    result["coordinates"] = prepared.material.coordinates();
    result["frames"] = problem.timeline.frame_count;
    result["constraints"] = problem.constraints.size();
    result["model_error"] = problem.model->report.error_mean;
    result["quick"] = options.quick;
    recorder.add(result);
  }
}

}  // namespace

void material_suite(const SuiteOptions& options, Recorder& recorder) {
  run_material(sample_problem("flower", kCoordinates, recorder), options, recorder);
  run_material(sample_problem("dino", kCoordinates, recorder), options, recorder);
  if (const auto problem = tyrannosaurus_problem(kCoordinates, options, recorder)) {
    run_material(*problem, options, recorder);
  } else {
    recorder.note("material: tyrannosaurus left out, the public data is not there");
  }
}

}  // namespace limber::bench
