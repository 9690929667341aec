// The editors of the field side by side (space-time editing, figures 2 and 5). Each solves the same
// space-time problem in its own kinematics, and its answer is turned into shapes. The row
// "post-warped" is Barbic et al. 2012: solved with linear modes, the linear displacements then
// warped by full RS. The warp moves constrained nodes off their targets, by the constraint error
// after reconstruction.
//
// Problems as in figure 5: a body at rest, and one node that is led round. It is near the rest
// shape (5 constraints in frames 20 to 100 of 200) or far from it (20 in frames 30 to 125 of 380).
// Targets are the positions of the node by full RS of the first two modes, on a circle in their
// coordinates: every editor has motions that pass there.
//
// `solve_ms`: solver, constraints, solve to convergence (site tables ahead). `frame_us`: shapes of
// all frames, per frame, threads as they are. `constraint_*_pct`: distance to the targets in the
// shapes, of the body's length. `solved_max_pct`: the same in the solver's own kinematics.
// `shape_error_pct`: of the whole motion against full RS of the same z, relative.
#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "bench/suite.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/solver.h"
#include "tests/support/published.h"
#include "tests/support/reconstruction.h"

namespace limber::bench {
namespace {

using reduced::Reconstruction;
using reduced::ScaledModes;

constexpr int kEditorModes = 30, kManyModes = 200;
constexpr double kWeight = 1e4;

struct Path {
  const char* name;
  int frames, first, last, constraints;
  double radius;  // z of the first two modes
};
constexpr Path kNear{"near", 200, 20, 100, 5, 0.12};
constexpr Path kFar{"far", 380, 30, 125, 20, 0.6};

struct Body {
  NamedBody named;
  std::shared_ptr<const reduced::ReducedModel> model;
  ScaledModes modes, many_modes;
  int node = 0;
};

Body make_body(NamedBody named) {
  Body body{std::move(named), {}, {}, {}, 0};
  reduced::ModelOptions options;
  options.mode_count = kEditorModes;
  options.basis_size = 80;
  options.cubature_size = 32;
  body.model =
      std::make_shared<const reduced::ReducedModel>(reduced::build_model(body.named.body, options));
  body.modes = {body.model->eigenvalues, body.model->modes, body.model->rigid_count,
                body.model->mechanism_count};
  bodies::ModalOptions modal;
  modal.mode_count = kManyModes;
  body.many_modes =
      reduced::scale_modes(body.named.body, bodies::modal_analysis(body.named.body, modal));
  Eigen::Index farthest = 0;
  Eigen::Map<const Eigen::Matrix3Xd>(body.modes.modes.col(0).data(), 3,
                                     body.named.body.mesh.node_count())
      .colwise()
      .squaredNorm()
      .maxCoeff(&farthest);
  body.node = static_cast<int>(farthest);
  return body;
}

struct Targets {
  std::vector<int> frames;
  Eigen::Matrix3Xd positions;  // displacements from rest [m]
};

Targets targets_of(const Body& body, const Path& path) {
  Targets targets;
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(body.modes.count(), path.constraints);
  for (int i = 0; i < path.constraints; ++i) {
    const double part = static_cast<double>(i) / (path.constraints - 1);
    const double angle = 1.6 * std::numbers::pi * part;
    targets.frames.push_back(path.first +
                             static_cast<int>(std::lround(part * (path.last - path.first))));
    z(0, i) = path.radius * std::cos(angle);
    z(1, i) = path.radius * std::sin(angle);
  }
  const auto full = reduced::make_full_reconstruction(body.named.body, body.modes);
  targets.positions = full->displacements(0, z).middleRows<3>(3 * Eigen::Index{body.node});
  return targets;
}

struct SolvedPath {
  Eigen::MatrixXd motion;
  spacetime::SolveReport report;
  double solve_ms = 0;
};

SolvedPath solve(const Body& body, const Path& path, const Targets& targets,
                 const ScaledModes& modes, std::shared_ptr<Reconstruction> editor) {
  const auto mapped = session::map_dynamics(testing::published_dynamics(), modes.eigenvalues,
                                            modes.rigid_count, modes.mechanism_count);
  const reduced::SiteId site = editor->add_site({body.node});
  spacetime::Timeline timeline;
  timeline.frame_count = path.frames;
  SolvedPath solved;
  solved.solve_ms = milliseconds([&] {
    spacetime::Solver solver(editor, mapped, timeline);
    for (std::size_t i = 0; i < targets.frames.size(); ++i) {
      spacetime::PositionConstraint constraint;
      constraint.id = i + 1;
      constraint.frame = targets.frames[i];
      constraint.site = site;
      constraint.target = targets.positions.col(static_cast<Eigen::Index>(i));
      constraint.weight = kWeight;
      solver.add(constraint);
    }
    solved.report = solver.solve();
    solved.motion = solver.motion();
  });
  return solved;
}

/// A row: an answer in the shapes of a reconstruction.
Case describe(const Body& body, const Path& path, const Targets& targets, const SolvedPath& solved,
              const Reconstruction& shapes, const Reconstruction& full) {
  Eigen::MatrixXd u;
  const double ms = milliseconds([&] { u = shapes.displacements(0, solved.motion); });
  const double length = shapes.length();
  double worst = 0, squares = 0;
  for (std::size_t i = 0; i < targets.frames.size(); ++i) {
    const Eigen::Vector3d at = u.col(targets.frames[i]).segment<3>(3 * Eigen::Index{body.node});
    const double miss = (at - targets.positions.col(static_cast<Eigen::Index>(i))).norm() / length;
    worst = std::max(worst, miss);
    squares += miss * miss;
  }
  const Eigen::MatrixXd truth = full.displacements(0, solved.motion);
  Case row;
  row["scene"] = body.named.name;
  row["targets"] = path.name;
  row["tets"] = body.named.body.mesh.tet_count();
  row["frames"] = path.frames;
  row["constraints"] = path.constraints;
  row["modes"] = solved.motion.rows();
  row["solve_ms"] = solved.solve_ms;
  row["iterations"] = solved.report.iterations;
  row["converged"] = solved.report.status == spacetime::SolveStatus::kConverged;
  row["frame_us"] = 1e3 * ms / path.frames;
  row["constraint_max_pct"] = 100 * worst;
  row["constraint_rms_pct"] = 100 * std::sqrt(squares / static_cast<double>(targets.frames.size()));
  row["solved_max_pct"] = 100 * solved.report.max_constraint_error / length;
  row["force_energy"] = solved.report.force_energy;
  row["energy"] = solved.report.total_energy;
  row["shape_error_pct"] = 100 * (u - truth).norm() / truth.norm();
  return row;
}

void run(const Body& body, const Path& path, Recorder& recorder) {
  recorder.note(fmt::format("editors: {}, {}", body.named.name, path.name));
  const bodies::ElasticBody& elastic = body.named.body;
  const Targets targets = targets_of(body, path);
  std::shared_ptr<Reconstruction> linear = make_linear_reconstruction(elastic, body.modes),
                                  many = make_linear_reconstruction(elastic, body.many_modes),
                                  warped = make_warped_reconstruction(elastic, body.modes),
                                  full = make_full_reconstruction(elastic, body.modes),
                                  full_many = make_full_reconstruction(elastic, body.many_modes),
                                  reduced = reduced::make_reduced_reconstruction(body.model);
  const auto add = [&](const char* editor, const char* reconstruction, const SolvedPath& solved,
                       const Reconstruction& shapes, const Reconstruction& truth) {
    Case row = describe(body, path, targets, solved, shapes, truth);
    Case named;
    for (const auto& [key, value] : row.items()) {
      named[key] = value;
      if (key != "targets") continue;
      named["editor"] = editor;
      named["reconstruction"] = reconstruction;
    }
    recorder.add(named);
  };
  const SolvedPath by_linear = solve(body, path, targets, body.modes, linear);
  add("linear", "linear", by_linear, *linear, *full);
  add("post-warped", "full RS", by_linear, *full, *full);
  const SolvedPath by_many = solve(body, path, targets, body.many_modes, many);
  add("linear", "linear", by_many, *many, *full_many);
  add("post-warped", "full RS", by_many, *full_many, *full_many);
  add("modal warping", "modal warping", solve(body, path, targets, body.modes, warped), *warped,
      *full);
  add("full RS", "full RS", solve(body, path, targets, body.modes, full), *full, *full);
  const SolvedPath by_reduced = solve(body, path, targets, body.modes, reduced);
  add("reduced RS", "reduced RS", by_reduced, *reduced, *full);
  add("reduced RS", "full RS", by_reduced, *full, *full);
}

}  // namespace

void editors_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const char* name : {"flower", "beam", "dino"}) {
    std::optional<NamedBody> named = load_body(name, options);
    if (!named) {
      recorder.note(fmt::format("editors: no {} (public data not found)", name));
      continue;
    }
    if (options.quick && std::string(name) == "dino") {
      recorder.note("editors: dino left out by --quick");
      continue;
    }
    named->name = name;
    recorder.note(fmt::format("editors: building {}", name));
    const Body body = make_body(std::move(*named));
    for (const Path& path : {kNear, kFar}) run(body, path, recorder);
  }
}

}  // namespace limber::bench
