// Recovery of material from the first half of a motion, and its second half by free motion of the
// recovered modes (space-time editing, section 6.3, figures 10 to 13).
#include <fmt/core.h>

#include "tests/support/dense.h"

#include "bench/recovery_scenes.h"
#include "bench/suite.h"
#include "engine/reduced/modal_projection.h"
#include "engine/reduced/reduced_model.h"
#include "engine/spacetime/recovery.h"

namespace limber::bench {
namespace {

using spacetime::MaterialVariables;
using spacetime::RecoveryStart;

struct Truth {
  RecoveryScene scene;
  std::shared_ptr<const reduced::ReducedModel> model;
  Eigen::MatrixXd z;  // z-bar of all frames
  int known = 0;      // frames that are recovered from
};

Truth prepare(RecoveryScene scene, int coordinates) {
  reduced::ModelOptions model_options;
  model_options.mode_count = coordinates;
  auto model = std::make_shared<const reduced::ReducedModel>(
      reduced::build_model(scene.generic, model_options));
  const reduced::ModalProjector projector(scene.generic, *model);
  Eigen::MatrixXd z = projector.motion(scene.displacements).z;
  const auto known = static_cast<int>(z.cols() / 2);
  return {std::move(scene), std::move(model), std::move(z), known};
}

/// Displacements of frames as the reduced model makes them of z.
Eigen::MatrixXd displacements(const Truth& truth, const Eigen::MatrixXd& z) {
  const reduced::ReducedKinematics kinematics(truth.model);
  Eigen::MatrixXf q;
  kinematics.coordinates(0, z, q);
  return truth.model->basis * q.cast<double>();
}

double relative(const Eigen::MatrixXd& got, const Eigen::MatrixXd& expected) {
  return (got - expected).norm() / expected.norm();
}

/// The least E_c^RS that any S and z of so many modes have: the residual of principal components.
double least_constraint(const Eigen::MatrixXd& z, int modes) {
  return 0.5 * reference::symmetric_eigenvalues(z * z.transpose())
                   .head(z.rows() - modes)
                   .cwiseMax(0)
                   .sum();
}

/// Whether forces in the frames in which the scene's loads act count.
enum class Loads { kKnown, kCharged };

struct Variant {
  std::string suffix;  // of the scene's name
  double weight;
  Loads loads;
};

void recover(const Truth& truth, const Variant& variant, int modes, MaterialVariables variables,
             RecoveryStart start, Recorder& recorder) {
  spacetime::RecoveryOptions options;
  options.modes = modes;
  options.variables = variables;
  options.start = start;
  options.weight = variant.weight;
  options.driven_frames = variant.loads == Loads::kKnown ? truth.scene.driven_frames : 0;
  spacetime::Recovery recovery;
  const double ms = milliseconds([&] {
    recovery = spacetime::recover(truth.z.leftCols(truth.known), truth.model->eigenvalues, options);
  });
  const auto ahead = static_cast<int>(truth.z.cols()) - truth.known;
  const auto continued = spacetime::continue_freely(recovery.motion, ahead);
  const Eigen::MatrixXd got = displacements(truth, recovery.motion.mixing * continued.z);
  const Eigen::MatrixXd swung =
      displacements(truth, recovery.motion.mixing * spacetime::continue_freely(recovery, ahead).z);
  const Eigen::MatrixXd expected = truth.scene.displacements.rightCols(ahead);
  const char* const names[] = {"z", "z_lambda_d", "all"};
  Case row;
  row["scene"] = truth.scene.name + variant.suffix;
  row["modes"] = modes;
  row["variables"] = names[static_cast<int>(variables)];
  row["e_force"] = recovery.report.energies.force;
  row["e_constraint"] = recovery.report.energies.constraint;
  row["final_frame_error"] = relative(got.rightCols<1>(), expected.rightCols<1>());
  row["second_half_error"] = relative(got, expected);
  row["second_half_error_of_swings"] = relative(swung, expected);
  row["least_constraint"] = least_constraint(truth.z.leftCols(truth.known), modes);
  row["start"] = variables != MaterialVariables::kAll || start == RecoveryStart::kSpectrum
                     ? "spectrum"
                     : "principal";
  row["gamma"] = variant.weight;
  row["iterations"] = recovery.report.steps;
  row["converged"] = recovery.report.status == spacetime::RecoveryStatus::kConverged;
  row["bounded_modes"] = continued.bounded_modes;
  row["ms"] = ms;
  recorder.add(row);
}

void recover_all(const Truth& truth, const Variant& variant, Recorder& recorder) {
  for (const int modes : {2, 10}) {
    for (const auto variables : {MaterialVariables::kMotion, MaterialVariables::kMotionAndDynamics,
                                 MaterialVariables::kAll}) {
      recover(truth, variant, modes, variables, RecoveryStart::kPrincipalComponents, recorder);
    }
  }
}

/// @param part  after the scene's name
void recover_scene(const Truth& truth, const std::string& part, Recorder& recorder) {
  recover_all(truth, {part, 1, Loads::kKnown}, recorder);
  for (const int modes : {2, 10}) {
    recover(truth, {part + " (paper's start)", 1, Loads::kKnown}, modes, MaterialVariables::kAll,
            RecoveryStart::kSpectrum, recorder);
    for (const auto& [suffix, weight] :
         {std::pair{" (gamma 1e-2)", 1e-2}, {" (gamma 1e-4)", 1e-4}}) {
      recover(truth, {part + suffix, weight, Loads::kKnown}, modes, MaterialVariables::kAll,
              RecoveryStart::kPrincipalComponents, recorder);
    }
  }
  if (truth.scene.driven_frames > 0)
    recover_all(truth, {part + " (loads charged)", 1, Loads::kCharged}, recorder);
}

}  // namespace

void recovery_suite(const SuiteOptions& options, Recorder& recorder) {
  const int frames = options.quick ? 120 : 300, coordinates = 80;
  struct RecoveryCase {
    std::string name, part;
    double share;
  };
  for (const RecoveryCase& recovery_case :
       {RecoveryCase{"beam", "", 1}, RecoveryCase{"dino", "", 1},
        RecoveryCase{"beam", ", quarter", 0.25}, RecoveryCase{"dino", ", quarter", 0.25}}) {
    const std::string title = recovery_case.name + recovery_case.part;
    if (options.quick && title != "beam") {
      recorder.note(fmt::format("recovery: {} left out by --quick", title));
      continue;
    }
    recorder.note(fmt::format("recovery: {}, simulating {} frames", title, frames));
    auto scene = recovery_scene(recovery_case.name, frames, options, recovery_case.share);
    if (!scene) {
      recorder.note(fmt::format("recovery: no {} (public data not found)", title));
      continue;
    }
    recorder.note(fmt::format(
        "recovery: {}, {:.3g} frames a second, simulated in {:.1f} s, largest displacement {:.3f} "
        "body lengths",
        title, scene->frames_per_second, scene->simulation_ms / 1000, scene->largest));
    const Truth truth = prepare(std::move(*scene), coordinates);
    recorder.note(
        fmt::format("recovery: {}, projected motion off by {:.2g} in the second half", title,
                    relative(displacements(truth, truth.z).rightCols(frames - truth.known),
                             truth.scene.displacements.rightCols(frames - truth.known))));
    recover_scene(truth, recovery_case.part, recorder);
  }
}

}  // namespace limber::bench
