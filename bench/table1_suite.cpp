// Table 1 of space-time editing, row by row, with the same sizes (its beam, dinosaur and
// tyrannosaurus; our flower and bird), h = R = 80. Printed values are given too (paper_*, seconds
// of a 2.93 GHz Core 2).
//
// Two models per body. The paper's method (md_*, weights_*): StVK modal derivatives, scalar weights
// on as many tets as it prints. Ours: the better basis (basis_kind says which), fitted maps on 32
// tets. *_basis_s: modal analysis and B; *_cubature_s: training poses and cubature. Errors: mean
// over held-out poses, of displacements against full RS. Their poses take all 80 modes at equal
// energies, more than the simulated training poses of the paper can have. `*_of_30`: the same sizes
// built and judged with the leading 30 modes only, from which the paper makes its basis.
// `training_poses` is ours; weights are fitted to at most 400.
//
// Optimisation: z, Lambda, D and S, as many constraints, frames and modes as printed. The rows with
// 150 constraints are recoveries, of poses in all 150 frames of a simulated motion
// (recovery_scenes.h). The other constraints of the paper are not published: here they are
// positions on a smooth path of the body (path_problem.h). Columns: table1_optimisation.h;
// literal_* and to_literal_s are left out by --quick and not for recoveries.
#include <fmt/core.h>

#include <map>

#include "bench/path_problem.h"
#include "bench/suite.h"
#include "bench/table1_optimisation.h"
#include "engine/reduced/training_set.h"

namespace limber::bench {
namespace {

struct PaperRow {
  const char* scene;
  const char* figure;
  int tets, nodes, modes;
  double basis_s, cubature_s;
  int training_poses, cubature_tets;
  double cubature_error;
  int constraints, frames, outer, inner;
  double optimise_s;
};
constexpr PaperRow kRows[] = {
    {"tyrannosaurus", "1", 6658, 2398, 30, 21.8, 19.8, 250, 74, 0.0290, 27, 350, 3, 490, 3.040},
    {"flower", "7", 5078, 1828, 30, 6.7, 16.1, 300, 80, 0.0145, 20, 380, 17, 76, 1.189},
    {"bird", "8", 3113, 1111, 30, 4.2, 14.4, 200, 77, 0.0180, 3, 150, 12, 797, 1.052},
    {"beam", "12", 6144, 1377, 2, 15.1, 17.1, 500, 69, 0.0046, 150, 150, 23, 796, 0.379},
    {"beam", "12", 6144, 1377, 10, 15.1, 17.1, 500, 69, 0.0046, 150, 150, 9, 425, 0.796},
    {"dino", "10", 5249, 1493, 30, 16.7, 18.6, 500, 79, 0.0100, 150, 150, 6, 277, 3.340},
    {"dino", "14", 5249, 1493, 20, 16.9, 17.4, 420, 80, 0.0135, 112, 620, 7, 123, 1.731},
};
constexpr int kColumns = 80, kFittedTets = 32;

struct BuiltBody {
  NamedBody named;
  reduced::ModelReport paper, paper_of_30, ours_of_30;
  int weighted_tets = 0;
  std::shared_ptr<const reduced::ReducedModel> ours;
  std::optional<RecoveryScene> recovery;  // once a row asks for it
};

reduced::ModelOptions paper_options(int modes, int tets) {
  reduced::ModelOptions options;
  options.mode_count = modes;
  options.basis_size = kColumns;
  options.basis = reduced::BasisKind::kModalDerivatives;
  options.cubature = reduced::CubatureKind::kWeights;
  options.cubature_size = tets;
  return options;
}

reduced::ModelOptions our_options(int modes) {
  reduced::ModelOptions options;
  options.mode_count = modes;
  options.basis_size = kColumns;
  options.cubature_size = kFittedTets;
  return options;
}

BuiltBody build(NamedBody named, const PaperRow& row) {
  constexpr int kLeading = 30;
  BuiltBody built{std::move(named), {}, {}, {}, 0, {}, {}};
  const bodies::ElasticBody& body = built.named.body;
  const reduced::ReducedModel paper =
      reduced::build_model(body, paper_options(kColumns, row.cubature_tets));
  built.paper = paper.report;
  built.weighted_tets = paper.cubature_size();
  built.ours = std::make_shared<const reduced::ReducedModel>(
      reduced::build_model(body, our_options(kColumns)));
  built.paper_of_30 = reduced::build_model(body, paper_options(kLeading, row.cubature_tets)).report;
  built.ours_of_30 = reduced::build_model(body, our_options(kLeading)).report;
  return built;
}

const char* name_of(reduced::BasisKind kind) {
  switch (kind) {
    case reduced::BasisKind::kBest:
      return "best";
    case reduced::BasisKind::kSnapshots:
      return "snapshots";
    case reduced::BasisKind::kModalDerivatives:
      return "modal derivatives";
    case reduced::BasisKind::kMapDerivatives:
      return "map derivatives";
  }
  return "";
}

Case describe(const PaperRow& row, const BuiltBody& built, const Optimised& optimised) {
  const reduced::ModelReport& ours = built.ours->report;
  Case result;
  result["scene"] = row.scene;
  result["figure"] = row.figure;
  result["tets"] = built.named.body.mesh.tet_count();
  result["nodes"] = built.named.body.mesh.node_count();
  result["modes"] = row.modes;
  result["md_basis_s"] = built.paper.modes_s + built.paper.basis_s;
  result["basis_s"] = ours.modes_s + ours.basis_s;
  result["paper_basis_s"] = row.basis_s;
  result["basis_kind"] = name_of(ours.basis);
  result["weights_cubature_s"] = built.paper.poses_s + built.paper.cubature_s;
  result["cubature_s"] = ours.poses_s + ours.cubature_s;
  result["paper_cubature_s"] = row.cubature_s;
  result["training_poses"] = reduced::automatic_training_poses(built.named.body.mesh.tet_count());
  result["paper_training_poses"] = row.training_poses;
  result["weights_cubature_tets"] = built.weighted_tets;
  result["cubature_tets"] = built.ours->cubature_size();
  result["paper_cubature_tets"] = row.cubature_tets;
  result["md_basis_error"] = built.paper.basis_error_mean;
  result["weights_cubature_error"] = built.paper.error_mean;
  result["basis_error"] = ours.basis_error_mean;
  result["cubature_error"] = ours.error_mean;
  result["weights_cubature_error_of_30"] = built.paper_of_30.error_mean;
  result["cubature_error_of_30"] = built.ours_of_30.error_mean;
  result["paper_cubature_error"] = row.cubature_error;
  result["constraints"] = row.constraints;
  result["frames"] = row.frames;
  result["outer_iterations"] = optimised.outer_iterations;
  result["paper_outer_iterations"] = row.outer;
  result["inner_iterations"] = optimised.inner_iterations;
  result["paper_inner_iterations"] = row.inner;
  result["optimise_s"] = optimised.seconds;
  result["paper_optimise_s"] = row.optimise_s;
  const auto known = [](const std::optional<double>& value) {
    return value ? Case(*value) : Case(nullptr);
  };
  result["literal_s"] = known(optimised.literal_seconds);
  result["to_literal_s"] = known(optimised.seconds_to_literal);
  result["energy"] = optimised.energy;
  result["literal_energy"] = known(optimised.literal_energy);
  result["converged"] = optimised.converged;
  result["z_only_s"] = optimised.z_only_seconds;
  result["force_energy_z_only"] = optimised.z_only_force_energy;
  result["force_energy"] = optimised.force_energy;
  result["constraint_error"] = optimised.constraint_error;
  return result;
}

bool is_recovery(const PaperRow& row) { return row.constraints == row.frames; }

Optimised optimise(const PaperRow& row, BuiltBody& body, const SuiteOptions& options) {
  if (is_recovery(row)) {
    if (!body.recovery) body.recovery = recovery_scene(row.scene, row.frames, options);
    return optimise_recovery(*body.recovery, *body.ours, row.modes, options.repeats);
  }
  const PathShape shape{row.frames, row.constraints, row.modes, 0.25, 40};
  return optimise_positions(path_problem(body.named, body.ours, shape),
                            options.quick ? Baseline::kNone : Baseline::kLiteral, options.repeats);
}

}  // namespace

void table1_suite(const SuiteOptions& options, Recorder& recorder) {
  std::map<std::string, BuiltBody>
      built;  // the paper's two beams, and its two dinosaurs, share one
  for (const PaperRow& row : kRows) {
    if (options.quick && std::string(row.scene) != "flower") {
      recorder.note(
          fmt::format("table1: {} (figure {}) left out by --quick", row.scene, row.figure));
      continue;
    }
    std::optional<NamedBody> named = load_body(row.scene, options);
    if (!named) {
      recorder.note(fmt::format("table1: no {} (public data not found)", row.scene));
      continue;
    }
    if (built.count(row.scene) == 0) {
      recorder.note(fmt::format("table1: building {}", row.scene));
      built.emplace(row.scene, build(std::move(*named), row));
    }
    BuiltBody& body = built.at(row.scene);
    recorder.note(
        fmt::format("table1: {} (figure {}), {} modes", row.scene, row.figure, row.modes));
    recorder.add(describe(row, body, optimise(row, body, options)));
  }
}

}  // namespace limber::bench
