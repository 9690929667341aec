// Reduced models: the error that they report against poses that they have never seen.

#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "bench/stability/box_bodies.h"
#include "bench/stability/sweep.h"
#include "engine/base/random.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/reduced_model.h"

namespace limber::bench::stability {
namespace {

using bodies::ElasticBody;
using Eigen::MatrixXd;

constexpr int kPoses = 100, kModes = 8;
// The mean over so many other poses may be so many times the tolerance.
constexpr double kAllowedTimes = 1.3;

/// Poses of the distribution that the tolerance is meant for, none of which the builder has seen.
MatrixXd poses_of(const reduced::ReducedModel& model, double amplitude) {
  Random random(2711);
  const reduced::ScaledModes modes{model.eigenvalues, model.modes, model.rigid_count,
                                   model.mechanism_count};
  return reduced::sample_poses(modes, model.length, amplitude, reduced::PoseLevels::kTest, kPoses,
                               random);
}

Finding built(const ElasticBody& body) {
  reduced::ModelOptions options;
  options.mode_count = kModes;
  options.training_poses = 800;
  const auto model =
      std::make_shared<const reduced::ReducedModel>(reduced::build_model(body, options));
  const reduced::ReducedKinematics kinematics(model);
  const MatrixXd z = poses_of(*model, options.amplitude);
  Eigen::MatrixXf coordinates;
  kinematics.coordinates(0, z, coordinates);
  const MatrixXd shown = model->basis * coordinates.cast<double>();
  const MatrixXd full = reduced::FullReconstruction(body).from_linear(model->modes * z);
  Finding finding;
  finding.claim = model->report.met_tolerance ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite = shown.allFinite() && full.allFinite();
  finding.error = ((shown - full).colwise().norm().array() / full.colwise().norm().array()).mean();
  finding.allowed = kAllowedTimes * options.tolerance;
  finding.message = fmt::format("mean error {:.2g} by the model's report, {} columns, {} tets. {}",
                                model->report.error_mean, model->basis_size(),
                                model->cubature_size(), model->report.message);
  return finding;
}

ElasticBody box(const Eigen::Vector3d& size, double nu = 0.4, Held held = Held::kLeftFace) {
  return box_body({8, 2, 3}, size, held, {1e6, nu, 1000});
}

Sweep model_sweep(const char* name, const char* parameter, std::vector<double> values, int required,
                  std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "reduced";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "a model of 8 modes with a mean error below 1 %";
  sweep.check = "full reconstructions of 100 poses that the builder has not seen (limit 1.3 %)";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps model_sweeps() {
  const Eigen::Vector3d usual(1, 0.2, 0.3);
  return {
      model_sweep("models, nearly incompressible", "0.5 - nu", {1e-1, 1e-2, 1e-4, 1e-6, 1e-8}, 3,
                  [=](double distance) { return built(box(usual, 0.5 - distance)); }),
      model_sweep("models, held half stiff", "contrast", {1e2, 1e4, 1e8, 1e12}, 3,
                  [=](double contrast) {
                    ElasticBody body = box(usual);
                    stiffen(body, contrast, [](const auto& x) { return x.x() < 0.5; });
                    return built(body);
                  }),
      model_sweep("models, a stiff middle in a free body", "contrast", {1e2, 1e4, 1e8, 1e12}, 3,
                  [=](double contrast) {
                    ElasticBody body = box(usual, 0.4, Held::kNothing);
                    stiffen(body, contrast,
                            [](const auto& x) { return std::abs(x.x() - 0.5) < 0.2; });
                    return built(body);
                  }),
      model_sweep("models, slender", "length over thickness", {10, 100, 1e3, 1e4, 1e6}, 3,
                  [=](double slenderness) {
                    return built(box({1, 1 / slenderness, 1.5 / slenderness}));
                  }),
      model_sweep("models, one sliver", "height of the sliver [cells]", {1e-1, 1e-3, 1e-6, 1e-9}, 3,
                  [=](double height) {
                    ElasticBody body = box(usual);
                    make_sliver(body, height);
                    return built(prepared(body));
                  }),
      model_sweep("models, size", "length of the body [m]", {1, 1e3, 1e-3, 1e-6, 1e-9}, 5,
                  [=](double length) { return built(box(length * usual)); }),
  };
}

}  // namespace limber::bench::stability
