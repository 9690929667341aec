#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "engine/base/clauses.h"
#include "engine/base/error.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/bodies/smooth_modes.h"
#include "engine/reduced/basis_choice.h"
#include "engine/reduced/cubature.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/training_set.h"

namespace limber::reduced {
namespace {

// The validation poses are a sample: their limit is a little stricter, so that the test poses
// agree.
constexpr double kMargin = 0.9;
// First models: how many modes and poses, to which error of shapes and of modes.
constexpr int kFirstModes = 10;
constexpr double kFirstTolerance = 0.05;
constexpr int kFirstPoses = 100;
constexpr int kFirstTestPoses = 10;
constexpr double kFirstModesTolerance = 1e-2;
// The stiffness matrix of larger meshes is not factored for the first model: for a block of 90,000
// tets that takes more than a second.
constexpr int kMaxFactoredTets = 60000;
constexpr int kMaxAttempts = 3;  // cubatures that are tried at most

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Mean relative errors of the basis alone, and errors of the model, on poses it has never seen.
struct Errors {
  double basis_mean = 0;
  Eigen::VectorXd model;
};
Errors held_out_errors(const ReducedModel& model, const Snapshots& snapshots) {
  const PoseData poses = snapshots.project(model.basis);
  const Eigen::MatrixXd q = reduced_coordinates(model.rs_modes, model.map, model.direct, poses.z);
  return {relative_errors(poses, poses.q).mean(), relative_errors(poses, q)};
}

void report_errors(const TrainingSet& set, double tolerance, ReducedModel& model) {
  const Errors test = held_out_errors(model, set.test);
  ModelReport& report = model.report;
  report.basis_error_mean = test.basis_mean;
  report.error_mean = test.model.mean();
  report.error_max = test.model.maxCoeff();
  report.small_error_mean = held_out_errors(model, set.small).model.mean();
  report.met_tolerance = report.error_mean <= tolerance;
  if (report.met_tolerance) return;
  report.message = fmt::format(
      "mean relative error {:.3g} on held-out poses, above the tolerance {:.3g}, with {} basis "
      "vectors (alone {:.3g}) "
      "and {} cubature tets",
      report.error_mean, tolerance, model.basis_size(), report.basis_error_mean,
      model.cubature_size());
}

void report_mechanisms(ReducedModel& model) {
  if (model.mechanism_count == 0) return;
  append_clause(
      model.report.message,
      fmt::format("{} of {} modes without stiffness: mechanisms (parts that fold about an "
                  "edge or a node, a body held along a line or at a node), which only "
                  "constraints hold",
                  model.mechanism_count, model.coordinate_count() - model.rigid_count));
}

/// Reports frequencies that are unexpectedly uncertain because of rounding.
void report_uncertainty(const bodies::ModalBasis& eigen, ReducedModel& model) {
  constexpr double kExpected = 1e-4;
  if (eigen.eigenvalue_error <= kExpected) return;
  append_clause(
      model.report.message,
      fmt::format("squared frequencies are certain to {:.1g} of themselves only: cells this "
                  "flat, or stiffnesses this far apart, leave no more digits",
                  eigen.eigenvalue_error));
}

void check_basis_size(const bodies::ElasticBody& body, const ModelOptions& options) {
  if (!body.is_free() || options.basis_size == 0 || options.basis_size > 3) return;
  throw Error(ErrorCode::kInvalidArgument, "basis_size",
              fmt::format("ModelOptions::basis_size = {}, must be > 3 for a free body, whose "
                          "translations take the first three columns",
                          options.basis_size));
}

/// The common part of every build: from modes on.
/// @param watch  since the build began
ReducedModel build_from_modes(const bodies::ElasticBody& body, const bodies::ModalBasis& eigen,
                              const ModelOptions& options, const JobContext& job,
                              const Eigen::MatrixXd& animation, Stopwatch watch) {
  ReducedModel model;
  const ScaledModes modes = scale_modes(body, eigen);
  model.report.modes_s = watch.lap();

  const FullReconstruction full(body);
  TrainingSet set = make_training_set(body, modes, full, options, job.part(0.25, 0.55));
  model.report.poses_s = watch.lap();

  job.report("basis", 0.55);
  const auto [basis, validation] = choose_basis({body, eigen, modes, full, set, animation, options},
                                                model.report, job.part(0.55, 0.6));
  model.report.basis_s = watch.lap();
  const PoseData train =
      project_training(set, modes, full, basis, options.tolerance, job.part(0.6, 0.7));
  model.report.poses_s += watch.lap();

  CubatureInput input{body,  full.gradient(), modes,   basis,
                      train, validation,      options, kMargin * options.tolerance};
  model.node_count = body.mesh.node_count();
  model.length = body.length();
  model.rigid_count = modes.rigid_count;
  model.mechanism_count = modes.mechanism_count;
  model.eigenvalues = modes.eigenvalues;
  model.modes = modes.modes;
  const bool chosen = options.basis_size == 0 || options.cubature_size == 0;
  double from = 0.7;
  for (int attempt = 1;; ++attempt) {
    const double to = 0.5 * (from + 0.98);
    const JobContext cubature_job = job.part(from, to);
    from = to;
    Cubature cubature = options.cubature == CubatureKind::kWeights
                            ? weigh_cubature(input, cubature_job)
                            : fit_cubature(input, cubature_job);
    model.basis = basis.leftCols(cubature.basis_size);
    model.tets = std::move(cubature.tets);
    model.rs_modes = std::move(cubature.rs_modes);
    model.map = std::move(cubature.map);
    model.direct = std::move(cubature.direct);
    report_errors(set, options.tolerance, model);
    if (model.report.met_tolerance || !chosen || !cubature.met_limit || attempt == kMaxAttempts)
      break;
    // Sizes that the validation poses flattered: chosen again, more strictly, and judged by poses
    // that had no part in that.
    input.limit *= 0.95 * options.tolerance / model.report.error_mean;
    set.test = further_test_poses(body, modes, full, options, attempt, job);
    model.report.message.clear();
  }
  report_mechanisms(model);
  report_uncertainty(eigen, model);
  model.report.cubature_s = watch.lap();
  return model;
}

}  // namespace

ReducedModel build_model(const bodies::ElasticBody& body, const ModelOptions& options,
                         const JobContext& job, const Eigen::MatrixXd& animation) {
  options.validate();
  check_basis_size(body, options);
  if (animation.size() > 0 &&
      (animation.rows() != 3 * body.mesh.node_count() || !animation.allFinite())) {
    throw Error(ErrorCode::kInvalidArgument, "animation",
                "animation must have three finite rows per node");
  }
  const Stopwatch watch;
  job.report("modes", 0);
  bodies::ModalOptions modal;
  modal.mode_count = options.mode_count;
  const bodies::ModalBasis eigen = bodies::modal_analysis(body, modal, job.part(0, 0.25));
  ReducedModel model = build_from_modes(body, eigen, options, job, animation, watch);
  job.report("done", 1);
  return model;
}

ReducedModel build_first_model(const bodies::ElasticBody& body, const ModelOptions& options,
                               const JobContext& job) {
  options.validate();
  const Stopwatch watch;
  ModelOptions first;
  first.mode_count = std::min(options.mode_count, kFirstModes);
  first.tolerance = std::max(options.tolerance, kFirstTolerance);
  first.basis = BasisKind::kSnapshots;
  first.training_poses = kFirstPoses;
  first.test_poses = kFirstTestPoses;
  first.amplitude = options.amplitude;
  first.seed = options.seed;
  const JobContext quiet{job.cancellation, {}};
  bodies::ModalBasis eigen;
  if (body.mesh.tet_count() <= kMaxFactoredTets) {
    bodies::ModalOptions modal;
    modal.mode_count = first.mode_count;
    modal.tolerance = kFirstModesTolerance;
    eigen = bodies::modal_analysis(body, modal, quiet);
  } else {
    bodies::SmoothModesOptions smooth;
    smooth.mode_count = first.mode_count;
    eigen = bodies::smooth_modes(body, smooth, quiet);
  }
  ReducedModel model = build_from_modes(body, eigen, first, quiet, {}, watch);
  model.report.met_tolerance = model.report.met_tolerance && options.tolerance >= first.tolerance;
  return model;
}

}  // namespace limber::reduced
