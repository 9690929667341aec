// Errors of a basis of h columns for held-out poses, and its cost beyond modes and training poses.
// The basis is made from full reconstructions of training poses, StVK modal derivatives (the
// paper's), or second derivatives of the RS map. 30 modes. `error`: mean over the poses, relative;
// small_error: of poses at a hundredth of the amplitude.
#include <fmt/core.h>

#include "bench/suite.h"
#include "engine/reduced/basis_choice.h"

namespace limber::bench {
namespace {

struct Named {
  reduced::BasisKind kind;
  const char* name;
};
constexpr Named kBasisKinds[] = {{reduced::BasisKind::kSnapshots, "snapshots"},
                                 {reduced::BasisKind::kModalDerivatives, "modal_derivatives"},
                                 {reduced::BasisKind::kMapDerivatives, "map_derivatives"}};

double mean_error(const reduced::Snapshots& poses, const Eigen::MatrixXd& basis) {
  const reduced::PoseData projected = poses.project(basis);
  return reduced::relative_errors(projected, projected.q).mean();
}

}  // namespace

void basis_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const char* name : {"flower", "beam", "dino", "bunny"}) {
    const std::optional<NamedBody> named = load_body(name, options);
    if (!named) {
      recorder.note(fmt::format("basis: no {} (public data not found)", name));
      continue;
    }
    if (options.quick && named->body.mesh.tet_count() > 10000) {
      recorder.note(fmt::format("basis: {} left out by --quick", name));
      continue;
    }
    recorder.note(fmt::format("basis: {}", name));
    const bodies::ElasticBody& body = named->body;
    const bodies::ModalBasis modal = bodies::modal_analysis(body, {});
    const reduced::ScaledModes modes = reduced::scale_modes(body, modal);
    const reduced::FullReconstruction full(body);
    reduced::ModelOptions model_options;
    const reduced::TrainingSet set =
        reduced::make_training_set(body, modes, full, model_options, {});
    for (const int size : {40, 60, 80, 120}) {
      Case row;
      row["scene"] = name;
      row["tets"] = body.mesh.tet_count();
      row["basis"] = size;
      for (const auto& [kind, key] : kBasisKinds) {
        model_options.basis = kind;
        model_options.basis_size = size;
        reduced::ModelReport report;
        reduced::BasisChoice choice;
        const double ms = milliseconds([&] {
          choice =
              reduced::choose_basis({body, modal, modes, full, set, {}, model_options}, report, {});
        });
        row[std::string(key) + "_error"] = mean_error(set.test, choice.basis);
        row[std::string(key) + "_small_error"] = mean_error(set.small, choice.basis);
        row[std::string(key) + "_s"] = 1e-3 * ms;
      }
      recorder.add(row);
    }
  }
}

}  // namespace limber::bench
