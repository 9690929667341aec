// How times of linkages grow with joints and with edges a segment. Rows as those of growth_bodies.
// The linkage is that of dome_lines(), opened by 10 degrees, which takes it out of its plane.
#include <fmt/core.h>

#include "bench/dome_lines.h"
#include "bench/growth_rows.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/solver/condensed_solver.h"

namespace limber::bench {
namespace {

void grow_linkage(const char* growth, int rods, int edges, const SuiteOptions& options,
                  Recorder& recorder) {
  // A strip of glass fibre, 5 by 10 mm, in N and m.
  const rods::RodStiffness stiffness{1.25e6, 2.6, 10.4, 2.9};
  const rods::LinkageModel model(rods::build_linkage_graph(dome_lines(rods)), edges, stiffness);
  const int joints = model.variables().joints();
  const double size = std::string_view(growth) == "joints" ? joints : edges;
  recorder.note(fmt::format("growth_linkages: {} joints, {} edges", joints, edges));
  const auto add = [&](const char* what, double ms, int not_converged = 0) {
    Case row = growth_row(growth, size, what, ms, not_converged);
    row["unknowns"] = model.variables().size();
    recorder.add(row);
  };
  rods::LinkageState state(model);
  rods::LinkageEquilibrium equilibrium(model);
  rods::Conditions conditions;
  conditions.pins = {{joints / 2}};
  conditions.mean_opening_angle = state.mean_opening_angle() + 10 * kDegree;
  rods::EquilibriumReport report;
  const double opening = milliseconds([&] { report = equilibrium.solve(state, conditions); });
  add("iteration of an opening", opening / std::max(1, report.iterations), !report.converged());
  std::vector<double> moved;
  int failed = 0;
  for (int i = 0; i < options.repeats; ++i) {
    conditions.mean_opening_angle = *conditions.mean_opening_angle + 0.5 * kDegree;
    moved.push_back(milliseconds([&] { report = equilibrium.solve(state, conditions); }));
    failed += report.converged() ? 0 : 1;
  }
  add("opened by another half degree", median(moved), failed);
  rods::LinkageAssembly assembly(model);
  rods::CondensedMatrix matrix(model.chains());
  rods::CondensedSolver solver(model.chains());
  Eigen::VectorXd gradient(model.variables().size());
  std::vector<double> hessian, factor;
  for (int i = 0; i < 2 * options.repeats + 1; ++i) {
    hessian.push_back(milliseconds([&] { (void)assembly.hessian(state, gradient, matrix); }));
    factor.push_back(milliseconds([&] { (void)solver.factor(matrix, 1e-9); }));
  }
  add("Hessian", median(hessian));
  add("factor", median(factor));
}

}  // namespace

void growth_linkages_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const int rods : {5, 9, 15, 25}) grow_linkage("joints", rods, 10, options, recorder);
  for (const int edges : {5, 10, 20, 40, 80}) grow_linkage("edges", 9, edges, options, recorder);
}

}  // namespace limber::bench
