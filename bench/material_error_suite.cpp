// Time against error of material optimisation, from the same start, on the flower's own targets; R
// = 80, r = 30. The energies are those after each of limber's joint steps and after each outer
// round of the paper's alternation (bench/literal_material.h). Both keep frequencies below an
// eighth of the frame rate after ten slow steps or rounds, during which energies are of other
// bounds: rows begin after them. `error`: energy above the least that either found with these
// variables, in parts of that; the least itself has none and is left out.
#include <fmt/core.h>

#include <algorithm>

#include "bench/literal_material.h"
#include "bench/spacetime_problems.h"
#include "bench/suite.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"

namespace limber::bench {
namespace {

using spacetime::MaterialVariables;

constexpr int kErrorCoordinates = 80;
constexpr std::size_t kMostPoints = 40;  // of a trace

struct EnergyPoint {
  double ms = 0, energy = 0;
};

/// Points that are lower than all before them, thinned to kMostPoints; the last one stays.
std::vector<EnergyPoint> lowest_points(const std::vector<EnergyPoint>& trace) {
  std::vector<EnergyPoint> lower;
  for (const EnergyPoint& point : trace)
    if (lower.empty() || point.energy < lower.back().energy) lower.push_back(point);
  std::vector<EnergyPoint> thinned;
  const std::size_t stride = lower.size() / kMostPoints + 1;
  for (std::size_t i = 0; i < lower.size(); ++i)
    if (i % stride == 0 || i + 1 == lower.size()) thinned.push_back(lower[i]);
  return thinned;
}

void trace_material(const SpacetimeProblem& problem, MaterialVariables variables, const char* name,
                    Recorder& recorder) {
  const auto kinematics = std::make_shared<reduced::ReducedKinematics>(problem.model);
  const auto constraints = place_constraints(problem, *kinematics);
  const reduced::ReducedModel& model = *problem.model;
  const spacetime::Material start{
      problem.dynamics,
      spacetime::first_coordinates(model.coordinate_count(),
                                   static_cast<int>(problem.dynamics.stiffness.size()))};
  const double slow = spacetime::slow_frequency_of(
      problem.dynamics,
      reduced::reference_mode(model.coordinate_count(), model.rigid_count, model.mechanism_count));
  spacetime::MaterialOptions options;
  options.variables = variables;
  options.slow_frequency = slow;
  std::vector<EnergyPoint> ours, paper;
  const auto begin = std::chrono::steady_clock::now();
  spacetime::Solver solver(kinematics, start.dynamics, problem.timeline, {}, start.mixing);
  for (const auto& constraint : constraints) solver.add(constraint);
  solver.solve();
  spacetime::MaterialSolver joint(kinematics, problem.timeline, solver.constraint_set(), start,
                                  solver.motion(), options);
  joint.solve({}, [&](const spacetime::MaterialReport& report) {
    const std::chrono::duration<double, std::milli> since =
        std::chrono::steady_clock::now() - begin;
    if (report.iterations > options.slow_steps)
      ours.push_back({since.count(), report.total_energy});
    return true;
  });
  LiteralMaterialOptions literal_options;
  literal_options.variables = variables;
  literal_options.slow_frequency = slow;
  const LiteralMaterialResult literal =
      literal_material(kinematics, problem.timeline, constraints, start, literal_options);
  for (std::size_t i = static_cast<std::size_t>(literal_options.slow_rounds);
       i < literal.energies.size(); ++i)
    paper.push_back({literal.milliseconds[i], literal.energies[i]});
  ours = lowest_points(ours);
  paper = lowest_points(paper);
  if (ours.empty() || paper.empty()) throw std::runtime_error("material_error: no steps");
  const double least = std::min(ours.back().energy, paper.back().energy);
  for (const auto& [method, trace] : {std::pair{"limber", &ours}, {"paper", &paper}}) {
    for (const EnergyPoint& point : *trace) {
      if (point.energy <= least) continue;
      Case row;
      row["scene"] = problem.scene;
      row["mode"] = name;
      row["method"] = method;
      row["ms"] = point.ms;
      row["energy"] = point.energy;
      row["error"] = point.energy / least - 1;
      recorder.add(row);
    }
  }
}

}  // namespace

void material_error_suite(const SuiteOptions&, Recorder& recorder) {
  const SpacetimeProblem problem = sample_problem("flower", kErrorCoordinates, recorder);
  for (const auto& [variables, name] :
       {std::pair{MaterialVariables::kMotionAndDynamics, "z_lambda_d"},
        std::pair{MaterialVariables::kAll, "all"}}) {
    recorder.note(fmt::format("material_error: {}, {}", problem.scene, name));
    trace_material(problem, variables, name, recorder);
  }
}

}  // namespace limber::bench
