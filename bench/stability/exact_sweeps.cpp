// The optimum of the full rotation-strain map, against the plainly written judge of `limber-bench
// exact`.

#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "bench/judge/full_space_judge.h"
#include "bench/stability/box_bodies.h"
#include "bench/stability/sweep.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/solver.h"
#include "tests/support/published.h"

namespace limber::bench::stability {
namespace {

using bodies::ElasticBody;

constexpr int kJudgeSteps = 200;
constexpr double kAllowedEnergy = 1e-5;

reduced::ReducedModel modes_alone(const ElasticBody& body, int count) {
  const reduced::ScaledModes modes =
      reduced::scale_modes(body, bodies::modal_analysis(body, {.mode_count = count}));
  reduced::ReducedModel model;
  model.node_count = body.mesh.node_count();
  model.length = body.length();
  model.rigid_count = modes.rigid_count;
  model.mechanism_count = modes.mechanism_count;
  model.eigenvalues = modes.eigenvalues;
  model.modes = modes.modes;
  return model;
}

/// @param reach  of the targets [body lengths]
Finding exact(const ElasticBody& body, double reach, double weight = 100) {
  scene::Scene scene = scene_of(body, reach);
  const auto model =
      std::make_shared<const reduced::ReducedModel>(modes_alone(body, scene.model.mode_count));
  const spacetime::ModeDynamics dynamics =
      session::map_dynamics(testing::published_dynamics(scene.dynamics.period_frames),
                            model->eigenvalues, model->rigid_count, model->mechanism_count);
  const auto kinematics = std::make_shared<reduced::FullKinematics>(
      body, model, std::make_shared<const reduced::FullReconstruction>(body));
  spacetime::Timeline timeline;
  timeline.frame_count = scene.frame_count;
  spacetime::Solver solver(kinematics, dynamics, timeline);
  JudgedProblem judged{body, model->modes, model->length, dynamics, scene.frame_count, {}};
  double rest = 0;
  for (const scene::Constraint& item : scene.constraints) {
    spacetime::PositionConstraint constraint;
    constraint.id = judged.targets.size() + 1;
    constraint.frame = item.frame;
    constraint.target = item.target;
    constraint.weight = weight;
    constraint.site = kinematics->add_site(item.nodes);
    solver.add(constraint);
    judged.targets.push_back({item.nodes.front(), item.frame, item.target, weight});
    rest += 0.5 * weight * (item.target / model->length).squaredNorm();
  }
  const spacetime::SolveReport report = solver.solve();
  Finding finding;
  finding.claim = report.status == spacetime::SolveStatus::kConverged ? Claim::kConverged
                                                                      : Claim::kNotConverged;
  finding.is_finite = solver.motion().allFinite();
  finding.message = fmt::format("{} iterations. {}", report.iterations, report.message);
  finding.allowed = kAllowedEnergy;
  if (finding.claim == Claim::kNotConverged || !finding.is_finite) return finding;
  // The reported energy of its motion, and the possible gain from there.
  const double shown = judge(judged, solver.motion(), 0).energy;
  const double best = judge(judged, solver.motion(), kJudgeSteps).energy;
  const double scale = std::max(best, 1e-10 * rest);  // weights beyond reach leave nothing else
  finding.error = std::max(std::abs(report.total_energy - shown), std::abs(shown - best)) / scale;
  return finding;
}

ElasticBody box(double length = 1, double nu = 0.4) {
  return box_body({8, 1, 2}, length * Eigen::Vector3d(1, 0.12, 0.2), Held::kLeftFace,
                  {1e6, nu, 1000});
}

Sweep exact_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                  std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "spacetime";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "the cold optimum of a box pulled aside twice by the full map";
  sweep.check = "the full-space judge: its energy of the motion, and what it gains from there";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps exact_sweeps() {
  return {
      exact_sweep("full map, nearly incompressible", "0.5 - nu", {1e-1, 1e-2, 1e-4, 1e-6, 1e-8}, 3,
                  [](double distance) { return exact(box(1, 0.5 - distance), 0.7); }),
      exact_sweep("full map, free half stiff", "contrast", {1e2, 1e4, 1e8, 1e12}, 3,
                  [](double contrast) {
                    ElasticBody body = box();
                    stiffen(body, contrast, [](const auto& x) { return x.x() > 0.5; });
                    return exact(body, 0.7);
                  }),
      exact_sweep("full map, one sliver", "height of the sliver [cells]", {1e-1, 1e-3, 1e-6, 1e-9},
                  3,
                  [](double height) {
                    ElasticBody body =
                        box_body({6, 2, 2}, {1, 0.12, 0.2}, Held::kLeftFace, {1e6, 0.4, 1000});
                    make_sliver(body, height);
                    return exact(prepared(body), 0.7);
                  }),
      exact_sweep("full map, size", "length of the body [m]", {1, 1e3, 1e-3, 1e-6, 1e-9}, 5,
                  [](double length) { return exact(box(length), 0.7); }),
      exact_sweep("full map, far targets", "reach [body lengths]",
                  {0.1, 0.3, 1, 3, 10, 100, 1e3, 1e4}, 4,
                  [](double reach) { return exact(box(), reach); }),
      exact_sweep("full map, heavy targets", "weight", decades(-8, 12, 4), 5,
                  [](double weight) { return exact(box(), 0.7, weight); }),
  };
}

}  // namespace limber::bench::stability
