// Time against error of linkages: burd deployed as the public code's measured runs do it, with 5 to
// 40 edges a segment (our knob) in two forms of bending. `error`: relative error of the deployed
// energy. The reference is extrapolated from 80 and 160 edges by the turning angle, the error going
// as the square of the edges' length. The row `public code` is its energy and wall at 10 edges,
// both as it printed them on another machine.
#include <fmt/core.h>

#include <cmath>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/scene/formats/line_formats.h"

namespace limber::bench {
namespace {

struct DeployedLinkage {
  double wall_ms = 0, energy = 0;
  int iterations = 0, failed = 0;
};

DeployedLinkage deploy_linkage(const LinkageCase& named, const rods::LinkageGraph& graph, int edges,
                               rods::BendingForm form, int repeats) {
  const rods::LinkageModel model(graph, edges, named.stiffness, form);
  rods::LinkageState closed(model);
  rods::Conditions conditions;
  conditions.pins = {{named.held}};
  rods::LinkageEquilibrium equilibrium(model);
  (void)equilibrium.solve(closed, conditions);
  conditions.mean_opening_angle = named.target * kDegree;
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  DeployedLinkage result;
  std::vector<double> walls;
  for (int i = 0; i < repeats; ++i) {
    rods::LinkageState state = closed;
    rods::DeploymentReport report;
    walls.push_back(
        milliseconds([&] { report = rods::deploy(equilibrium, state, conditions, options); }));
    result.energy = report.end.energies.total();
    result.iterations = report.iterations;
    result.failed = report.steps_failed + (report.end.converged() ? 0 : 1);
  }
  result.wall_ms = median(walls);
  return result;
}

}  // namespace

void linkage_error_suite(const SuiteOptions& options, Recorder& recorder) {
  const LinkageCase& named = linkage_case("burd");
  const auto path = find_linkage_lines(options, named.name, named.file, recorder);
  if (!path) return;
  const rods::LinkageGraph graph = rods::build_linkage_graph(scene::read_line_mesh_file(*path));
  using Form = rods::BendingForm;
  recorder.note("linkage_error: 80 and 160 edges");
  const double coarse = deploy_linkage(named, graph, 80, Form::kTurningAngle, 1).energy;
  const double fine = deploy_linkage(named, graph, 160, Form::kTurningAngle, 1).energy;
  const double expected = fine + (fine - coarse) / 3;
  const auto add = [&](const char* method, int edges, const DeployedLinkage& deployed) {
    Case row;
    row["model"] = named.name;
    row["method"] = method;
    row["edges"] = edges;
    row["ms"] = deployed.wall_ms;
    row["energy"] = deployed.energy;
    row["error"] = std::abs(deployed.energy / expected - 1);
    row["iterations"] = deployed.iterations;
    row["failed"] = deployed.failed;
    recorder.add(row);
  };
  for (const auto& [form, name] : {std::pair{Form::kMaterialFrames, "limber, 2008"},
                                   std::pair{Form::kTurningAngle, "limber, turning angle"}}) {
    for (const int edges : {5, 10, 20, 40}) {
      recorder.note(fmt::format("linkage_error: {}, {} edges", name, edges));
      add(name, edges, deploy_linkage(named, graph, edges, form, options.quick ? 3 : 5));
    }
  }
  add("public code", named.edges, {1e3 * named.known_wall, named.known_energy, 0, 0});
}

}  // namespace limber::bench
