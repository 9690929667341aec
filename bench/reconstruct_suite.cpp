// Full rotation-strain reconstruction of a frame against the reduced one, speed against error on
// held-out poses. $LIMBER_BENCH_ONLY: only bodies whose names contain it.
//
// Without --quick there are alternatives, too. Rows with `cubature` "linear modes", "modal warping"
// and "full" are of whole shapes in double precision, 3n numbers a frame. `batch_us_per_frame` is
// of whole shapes there, of coordinates q in the others.
#include <fmt/core.h>

#include "bench/suite.h"
#include "engine/base/random.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_sampling.h"
#include "engine/reduced/reduced_model.h"
#include "tests/support/reconstruction.h"

namespace limber::bench {
namespace {

/// Poses of the builder's own distribution (see reduced/pose_sampling.h: largest displacement of a
/// typical pose 0.1 to 0.5 body lengths) from a seed that it does not use.
Eigen::MatrixXd fresh_poses(const reduced::ReducedModel& model, int count) {
  Random random(20241);
  const reduced::ScaledModes modes{model.eigenvalues, model.modes, model.rigid_count,
                                   model.mechanism_count};
  return reduced::sample_poses(modes, model.length, reduced::ModelOptions{}.amplitude,
                               reduced::PoseLevels::kTest, count, random);
}

struct Reference {
  Eigen::MatrixXd z;
  Eigen::MatrixXd u;   // full reconstruction, 3n x poses
  double full_us = 0;  // per frame, one at a time on one thread
};

Reference reference(const bodies::ElasticBody& body, const reduced::ReducedModel& model, int poses,
                    int repeats) {
  const reduced::FullReconstruction full(body);
  Reference result{fresh_poses(model, poses), {}, 0};
  const Eigen::MatrixXd linear = model.modes * result.z;
  result.u = full.from_linear(linear);
  std::vector<double> one_by_one;
  Eigen::VectorXd v, u;
  for (int i = 0; i < std::max(5, repeats); ++i) {
    v = linear.col(i % poses);
    one_by_one.push_back(1e3 * milliseconds([&] { full.from_linear(v, u); }));
  }
  result.full_us = median(one_by_one);
  return result;
}

Case measure(const std::string& name, const bodies::ElasticBody& body,
             const reduced::ReducedModel& built, const Reference& truth, const char* kind,
             const SuiteOptions& options) {
  const auto model = std::make_shared<const reduced::ReducedModel>(built);
  const reduced::ReducedKinematics kinematics(model);
  Eigen::MatrixXf q;
  kinematics.coordinates(0, truth.z, q);
  const Eigen::MatrixXd u = model->basis * q.cast<double>();
  const Eigen::VectorXd errors =
      ((u - truth.u).colwise().norm().array() / truth.u.colwise().norm().array()).transpose();

  Eigen::MatrixXd many(truth.z.rows(), 1024);
  for (Eigen::Index i = 0; i < many.cols(); ++i) many.col(i) = truth.z.col(i % truth.z.cols());
  std::vector<double> batch, single;
  Eigen::MatrixXf scratch;
  for (int i = 0; i < 4 * options.repeats; ++i) {
    batch.push_back(1e3 * milliseconds([&] { kinematics.coordinates(0, many, scratch); }) / 1024);
    const Eigen::MatrixXd one = truth.z.col(i % truth.z.cols());
    single.push_back(1e3 * milliseconds([&] {
                       for (int repeat = 0; repeat < 50; ++repeat)
                         kinematics.coordinates(0, one, scratch);
                     }) /
                     50);
  }
  Case result;
  result["scene"] = name;
  result["tets"] = body.mesh.tet_count();
  result["cubature"] = kind;
  result["basis"] = model->basis_size();
  result["cubature_tets"] = model->cubature_size();
  result["full_us"] = truth.full_us;
  result["reduced_us"] = median(single);
  result["batch_us_per_frame"] = median(batch);
  result["error_mean"] = errors.mean();
  result["error_max"] = errors.maxCoeff();
  result["speedup"] = truth.full_us / median(batch);
  return result;
}

/// The alternatives on the same poses.
void add_alternatives(const std::string& name, const bodies::ElasticBody& body,
                      const reduced::ReducedModel& model, const Reference& truth,
                      const SuiteOptions& options, Recorder& recorder) {
  const reduced::ScaledModes modes{model.eigenvalues, model.modes, model.rigid_count,
                                   model.mechanism_count};
  const auto linear = reduced::make_linear_reconstruction(body, modes);
  const auto warped = reduced::make_warped_reconstruction(body, modes);
  const auto full = reduced::make_full_reconstruction(body, modes);
  for (const auto& [kind, shapes] : {std::pair{"linear modes", linear.get()},
                                     {"modal warping", warped.get()},
                                     {"full", full.get()}}) {
    Eigen::MatrixXd u;
    std::vector<double> times;
    for (int i = 0; i < options.repeats; ++i)
      times.push_back(1e3 * milliseconds([&] { u = shapes->displacements(0, truth.z); }) /
                      static_cast<double>(truth.z.cols()));
    const Eigen::VectorXd errors =
        ((u - truth.u).colwise().norm().array() / truth.u.colwise().norm().array()).transpose();
    Case row;
    row["scene"] = name;
    row["tets"] = body.mesh.tet_count();
    row["cubature"] = kind;
    row["batch_us_per_frame"] = median(times);
    row["error_mean"] = errors.mean();
    row["error_max"] = errors.maxCoeff();
    recorder.add(row);
  }
}

}  // namespace

void reconstruct_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const std::string name : {"beam", "dino", "bunny", "Armadillo13K"}) {
    if (!is_selected(name)) continue;
    const auto named = load_body(name, options);
    if (!named) {
      recorder.note(fmt::format("reconstruct: no {} (public data not found)", name));
      continue;
    }
    const bool large = named->body.mesh.tet_count() > 10000;
    if (options.quick && large && name != "Armadillo13K") {
      recorder.note(fmt::format("reconstruct: {} left out by --quick", name));
      continue;
    }
    Reference truth;
    auto add = [&](const reduced::ModelOptions& requested, const char* kind) {
      recorder.note(fmt::format("reconstruct: {}, {}, h = {}, T = {}", name, kind,
                                requested.basis_size, requested.cubature_size));
      const reduced::ReducedModel model = reduced::build_model(named->body, requested);
      if (truth.z.size() == 0) {
        truth = reference(named->body, model, options.quick ? 40 : 100, options.repeats);
        if (!options.quick) add_alternatives(name, named->body, model, truth, options, recorder);
      }
      recorder.add(measure(name, named->body, model, truth, kind, options));
    };
    reduced::ModelOptions requested;
    add(requested, "fitted maps, 1 % asked");
    if (options.quick) continue;
    const std::vector<int> bases = large ? std::vector<int>{80} : std::vector<int>{40, 80, 120};
    for (const int basis : bases) {
      for (const int tets : {10, 20, 40}) {
        requested.basis_size = basis;
        requested.cubature_size = tets;
        requested.cubature = reduced::CubatureKind::kFittedMaps;
        add(requested, "fitted maps");
      }
    }
    requested.cubature = reduced::CubatureKind::kWeights;
    for (const int tets : {40, 80}) {
      requested.basis_size = 80;
      requested.cubature_size = tets;
      add(requested, "weights");
    }
  }
}

}  // namespace limber::bench
