#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "engine/bodies/mass.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/fitted_cubature.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/snapshot_basis.h"
#include "engine/reduced/training_set.h"

namespace limber::reduced {
namespace {

constexpr int kLargestBasis = 200;
constexpr int kLargestCubature = 100;
constexpr int kPoolSize = 1000;

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

/// Tets that may be selected: a random subset, so that large meshes cost no more than small ones.
std::vector<int> random_pool(int tet_count, int size, Random& random) {
  std::vector<int> all(tet_count);
  for (int e = 0; e < tet_count; ++e) all[e] = e;
  const int count = std::min(size, tet_count);
  for (int k = 0; k < count; ++k)
    std::swap(all[k], all[k + static_cast<int>(random.index(tet_count - k))]);
  all.resize(count);
  std::sort(all.begin(), all.end());
  return all;
}

/// Smallest h whose mean error is at most `limit`; 0 if none is.
int smallest_size(const Eigen::VectorXd& error_by_size, double limit) {
  for (Eigen::Index h = 1; h <= error_by_size.size(); ++h) {
    if (error_by_size[h - 1] <= limit) return static_cast<int>(h);
  }
  return 0;
}

struct Sizes {
  int basis = 0;
  FittedCubature::Fit fit;
  int tets = 0;
};

/// Multiplications of one frame: Y z, H g and D z.
double frame_cost(int basis, int tets, Eigen::Index coordinates) {
  return 9.0 * tets * static_cast<double>(basis + coordinates) +
         static_cast<double>(basis * coordinates);
}

/// Adds tets until the cheapest pair (h, T) that meets the tolerance on the validation poses is
/// known.
Sizes choose_sizes(FittedCubature& cubature, const Eigen::VectorXd& basis_error,
                   const ModelOptions& options, Eigen::Index coordinates, const JobContext& job) {
  const int largest = static_cast<int>(basis_error.size());
  const int fewest_columns =
      options.basis_size > 0 ? largest : smallest_size(basis_error, options.tolerance);
  const int tet_limit = options.cubature_size > 0 ? options.cubature_size : kLargestCubature;
  // Below this many tets no fit is tried: cheap, and nothing meets a tolerance there.
  const int first_fit = options.cubature_size > 0 ? options.cubature_size : 1;
  std::optional<Sizes> best;
  double best_cost = 0;
  Sizes last;
  for (int t = 1; t <= tet_limit; ++t) {
    if (best && options.cubature_size == 0 &&
        frame_cost(fewest_columns, t, coordinates) >= best_cost)
      break;
    job.report("cubature", static_cast<double>(t) / tet_limit);
    const bool added = cubature.add_best_tet(job);
    if (added && t < first_fit) continue;
    last = {largest, cubature.fit(), static_cast<int>(cubature.tets().size())};
    const int h = options.basis_size > 0
                      ? (last.fit.validation_mean[largest - 1] <= options.tolerance ? largest : 0)
                      : smallest_size(last.fit.validation_mean, options.tolerance);
    if (h > 0 && (!best || frame_cost(h, last.tets, coordinates) < best_cost)) {
      best = last;
      best->basis = h;
      best_cost = frame_cost(h, last.tets, coordinates);
    }
    if (!added) break;
  }
  return best ? *best : last;
}

}  // namespace

ReducedModel build_model(const bodies::ElasticBody& body, const ModelOptions& options,
                         const JobContext& job) {
  options.validate();
  if (options.cubature == CubatureKind::kWeights) {
    throw Error(ErrorCode::kUnsupported, "cubature", "cubature by weights is not built yet");
  }
  Stopwatch watch;
  ReducedModel model;

  job.report("modes", 0);
  bodies::ModalOptions modal;
  modal.mode_count = options.mode_count;
  const ScaledModes modes =
      scale_modes(body, bodies::modal_analysis(body, modal, job.part(0, 0.25)));
  model.report.modes_s = watch.lap();

  const FullReconstruction full(body);
  const TrainingSet set = make_training_set(body, modes, full, options, job.part(0.25, 0.6));
  model.report.poses_s = watch.lap();

  job.report("basis", 0.6);
  const int largest = options.basis_size > 0 ? options.basis_size : kLargestBasis;
  Eigen::MatrixXd basis = snapshot_basis(set.train.u, bodies::lumped_node_mass(body.mesh),
                                         modes.modes.leftCols(modes.rigid_count / 2), largest);
  PoseData validation = set.validation.project(basis);
  Eigen::VectorXd basis_error = mean_error_by_size(validation, validation.q);
  if (options.basis_size == 0) {
    // More columns than this would not let the cubature be smaller by much.
    const int enough = smallest_size(basis_error, 0.4 * options.tolerance);
    if (enough > 0) {
      basis = basis.leftCols(enough).eval();
      validation.q = validation.q.topRows(enough).eval();
      basis_error = basis_error.head(enough).eval();
    }
  }
  const PoseData train = set.train.project(basis);
  model.report.basis_s = watch.lap();

  Random random(options.seed);
  FittedCubature cubature(full.gradient(), modes.modes, basis.transpose() * modes.modes, train,
                          validation, random_pool(full.gradient().tet_count(), kPoolSize, random));
  const Sizes sizes =
      choose_sizes(cubature, basis_error, options, modes.count(), job.part(0.65, 0.98));

  model.node_count = body.mesh.node_count();
  model.length = body.length();
  model.rigid_count = modes.rigid_count;
  model.eigenvalues = modes.eigenvalues;
  model.modes = modes.modes;
  model.basis = basis.leftCols(sizes.basis);
  model.map = sizes.fit.map.topRows(sizes.basis);
  model.tets.assign(cubature.tets().begin(), cubature.tets().begin() + sizes.tets);
  model.rs_modes = cubature.rs_modes().topRows(kRsSize * sizes.tets);
  model.direct = model.basis.transpose() * model.modes;
  for (int t = 0; t < sizes.tets; ++t) {
    for (Eigen::Index k = 0; k < modes.count(); ++k) {
      const RsVector y = model.rs_modes.col(k).segment<kRsSize>(kRsSize * t);
      const Eigen::Matrix3d h = linear_gradient(y);
      model.direct.col(k) -=
          model.map.middleCols<kRsSize>(kRsSize * t) * Eigen::Map<const RsVector>(h.data());
    }
  }

  const auto errors = [&](const Snapshots& snapshots) {
    const PoseData poses = snapshots.project(model.basis);
    Eigen::MatrixXd q = model.direct * poses.z;
    const Eigen::MatrixXd y = model.rs_modes * poses.z;
    Eigen::VectorXd g(y.rows());
    for (Eigen::Index s = 0; s < y.cols(); ++s) {
      for (int t = 0; t < sizes.tets; ++t) {
        const RsVector y_t = y.col(s).segment<kRsSize>(kRsSize * t);
        Eigen::Map<Eigen::Matrix3d>(g.data() + kRsSize * t) = displacement_gradient(y_t);
      }
      q.col(s) += model.map * g;
    }
    return std::make_pair(relative_errors(poses, poses.q), relative_errors(poses, q));
  };
  const auto [basis_test, test] = errors(set.test);
  model.report.basis_error_mean = basis_test.mean();
  model.report.error_mean = test.mean();
  model.report.error_max = test.maxCoeff();
  model.report.small_error_mean = errors(set.small).second.mean();
  model.report.cubature_s = watch.lap();
  model.report.met_tolerance = model.report.error_mean <= options.tolerance;
  if (!model.report.met_tolerance) {
    model.report.message = fmt::format(
        "mean relative error {:.3g} on held-out poses, above the tolerance {:.3g}, with {} basis "
        "vectors "
        "(alone {:.3g}) and {} cubature tets",
        model.report.error_mean, options.tolerance, model.basis_size(),
        model.report.basis_error_mean, model.cubature_size());
  }
  job.report("done", 1);
  return model;
}

}  // namespace limber::reduced
