#include "engine/reduced/cubature.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/base/parallel.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/fitted_cubature.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/weighted_cubature.h"

namespace limber::reduced {
namespace {

constexpr int kLargestFitted = 100;    // tets at most where no number is requested
constexpr int kLargestWeighted = 300;  // the same with scalar weights
// The choice of candidate tets matters little if it includes those that bend most (measured: 300
// are as good as 3000 where all do; drawn evenly, a bar with a strip 33 times softer missed its
// tolerance of 1 % by 3.3 %: tests UnevenBodies).
constexpr int kPoolSize = 400;
constexpr std::size_t kEvenShare = 8;
constexpr double kPoolPoses = 400'000;  // poses times tets by which deformation is judged, about
constexpr Eigen::Index kWeightPoses = 400;  // training poses that weights are fitted to

/// By tet, how much the training poses bend its shape functions: volume times what the nonlinear
/// part of its gradient amounts to, relative to the pose (root mean square).
Eigen::VectorXd nonlinearity(const CubatureInput& input) {
  const int tets = input.gradient.tet_count();
  const Eigen::Index poses = std::min<Eigen::Index>(
      input.train.count(), std::clamp(static_cast<int>(kPoolPoses / tets), 8, 64));
  const Eigen::MatrixXd z = input.train.z.leftCols(poses);
  const Eigen::VectorXd weight = input.train.norm.head(poses).cwiseInverse();
  Eigen::VectorXd amount(tets);
  parallel_for(tets, 64, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t e = begin; e < end; ++e) {
      const int tet = static_cast<int>(e);
      const Eigen::MatrixXd y = linear_coordinates(input.gradient, {tet}, input.modes.modes);
      amount[e] =
          input.gradient.volumes()[tet] * (weight.asDiagonal() * remainder_features(y, z)).norm();
    }
  });
  return amount;
}

/// Tets that may be selected: a random subset, so that large meshes cost no more than small ones.
/// One in kEvenShare is drawn evenly, the others in proportion to their weight.
std::vector<int> draw_pool(const Eigen::VectorXd& weights, int size, Random& random) {
  std::vector<int> all(static_cast<std::size_t>(weights.size()));
  std::iota(all.begin(), all.end(), 0);
  const auto count = std::min<std::size_t>(static_cast<std::size_t>(size), all.size());
  for (std::size_t k = 0; k < count / kEvenShare; ++k)
    std::swap(all[k], all[k + static_cast<std::size_t>(random.index(all.size() - k))]);
  // Without replacement: the largest of log(u) / w (Efraimidis and Spirakis 2006).
  std::vector<double> key(all.size());
  for (std::size_t k = count / kEvenShare; k < all.size(); ++k)
    key[static_cast<std::size_t>(all[k])] =
        std::log(1 - random.uniform()) / std::max(weights[all[k]], 1e-300);
  std::sort(all.begin() + static_cast<std::ptrdiff_t>(count / kEvenShare), all.end(),
            [&](int a, int b) {
              const double of_a = key[static_cast<std::size_t>(a)],
                           of_b = key[static_cast<std::size_t>(b)];
              return of_a != of_b ? of_a > of_b : a < b;
            });
  all.resize(count);
  std::sort(all.begin(), all.end());
  return all;
}

/// Multiplications of one frame: Y z, H g and D z.
double frame_cost(int basis, int tets, Eigen::Index coordinates) {
  return 9.0 * tets * static_cast<double>(basis + coordinates) +
         static_cast<double>(basis * coordinates);
}

struct FittedSizes {
  int basis = 0;
  int tets = 0;
  FittedCubature::Fit fit;
  bool met_limit = false;
};

FittedSizes choose_sizes(FittedCubature& cubature, const CubatureInput& input,
                         const JobContext& job) {
  const ModelOptions& options = input.options;
  const double limit = input.limit;
  const int largest = static_cast<int>(input.basis.cols());
  const bool any_basis = options.basis_size == 0, any_tets = options.cubature_size == 0;
  const int fewest_columns =
      any_basis ? smallest_size(mean_error_by_size(input.validation, input.validation.q), limit)
                : largest;
  const int tet_limit = any_tets ? kLargestFitted : options.cubature_size;
  std::optional<FittedSizes> best;
  FittedSizes last;
  const auto cost = [&](const FittedSizes& sizes) {
    return frame_cost(sizes.basis, sizes.tets, input.modes.count());
  };
  for (int t = 1; t <= tet_limit; ++t) {
    if (any_tets && best && frame_cost(fewest_columns, t, input.modes.count()) >= cost(*best))
      break;
    job.report("cubature", static_cast<double>(t) / tet_limit);
    const bool added = cubature.add_best_tet(job);
    // Fits cost more and more and differ less and less: not after every tet.
    const int stride = t <= 16 ? 1 : t <= 32 ? 2 : t <= 64 ? 8 : 18;
    if (added && t < tet_limit && (!any_tets || t % stride != 0)) continue;
    last = {largest, static_cast<int>(cubature.tets().size()), cubature.fit()};
    FittedSizes candidate = last;
    if (any_basis) {
      candidate.basis = smallest_size(last.fit.validation_mean, limit);
    } else if (last.fit.validation_mean[largest - 1] > limit) {
      candidate.basis = 0;
    }
    if (candidate.basis > 0 && (!best || cost(candidate) < cost(*best)))
      best = std::move(candidate);
    if (!added) break;
  }
  if (!best) return last;
  best->met_limit = true;
  return std::move(*best);
}

}  // namespace

int smallest_size(const Eigen::VectorXd& error_by_size, double limit) {
  for (Eigen::Index h = 1; h <= error_by_size.size(); ++h) {
    if (error_by_size[h - 1] <= limit) return static_cast<int>(h);
  }
  return 0;
}

Eigen::MatrixXd reduced_coordinates(const Eigen::MatrixXd& rs_modes, const Eigen::MatrixXd& map,
                                    const Eigen::MatrixXd& direct, const Eigen::MatrixXd& z) {
  Eigen::MatrixXd g = rs_modes * z;
  for (Eigen::Index s = 0; s < g.cols(); ++s) {
    for (Eigen::Index row = 0; row < g.rows(); row += kRsSize) {
      const RsVector y = g.col(s).segment<kRsSize>(row);
      Eigen::Map<Eigen::Matrix3d>(g.col(s).data() + row) = displacement_gradient(y);
    }
  }
  return map * g + direct * z;
}

Cubature fit_cubature(const CubatureInput& input, const JobContext& job) {
  Random random(input.options.seed);
  Eigen::MatrixXd affine;
  if (input.body.is_free()) {
    const Eigen::MatrixXd fields = affine_fields(input.body);
    if (input.basis.cols() > fields.cols()) {
      affine = input.basis.transpose() * fields.rightCols(kRsSize);
    }
  }
  FittedCubature fitted(input.gradient, input.modes.modes,
                        input.basis.transpose() * input.modes.modes, input.train, input.validation,
                        draw_pool(nonlinearity(input), kPoolSize, random), std::move(affine));
  const FittedSizes sizes = choose_sizes(fitted, input, job);
  Cubature result;
  result.basis_size = sizes.basis;
  result.met_limit = sizes.met_limit;
  result.tets.assign(fitted.tets().begin(), fitted.tets().begin() + sizes.tets);
  result.rs_modes = fitted.rs_modes().topRows(kRsSize * Eigen::Index{sizes.tets});
  result.map = sizes.fit.map.topRows(sizes.basis);
  result.direct = fitted.direct(result.map);
  return result;
}

Cubature weigh_cubature(const CubatureInput& input, const JobContext& job) {
  const ModelOptions& options = input.options;
  const double limit = input.limit;
  const int rigid = input.modes.rigid_count;
  int h = options.basis_size;
  if (h == 0) {
    h = smallest_size(mean_error_by_size(input.validation, input.validation.q), 0.45 * limit);
    if (h == 0) h = static_cast<int>(input.basis.cols());
  }
  const Eigen::MatrixXd basis = input.basis.leftCols(h);
  PoseData train = input.train, validation = input.validation;
  // One number per tet is fitted: the poses of the paper's order of magnitude are plenty.
  const Eigen::Index poses = std::min<Eigen::Index>(kWeightPoses, train.count());
  train.z = train.z.leftCols(poses).eval();
  train.q = train.q.topLeftCorner(h, poses).eval();
  train.norm = train.norm.head(poses).eval();
  validation.q.conservativeResize(h, Eigen::NoChange);
  Eigen::VectorXd share;
  if (rigid > 0) {
    share = bodies::lumped_node_mass(input.body.mesh);
    share /= share.sum();
  }

  Cubature result;
  result.basis_size = h;
  result.direct = Eigen::MatrixXd::Zero(h, input.modes.count());
  result.direct.leftCols(rigid / 2) = basis.transpose() * input.modes.modes.leftCols(rigid / 2);
  const auto update = [&](const WeightedCubature& cubature) {
    result.tets = cubature.tets();
    result.map = cubature.map();
    result.rs_modes = linear_coordinates(input.gradient, result.tets, input.modes.modes);
  };

  WeightedCubature cubature(input.gradient, input.modes.modes, basis, share, train, options.seed);
  const bool any_tets = options.cubature_size == 0;
  const int tet_limit = any_tets ? kLargestWeighted : options.cubature_size;
  // Weights that fall to zero leave their place to others: more steps than tets.
  for (int step = 0; step < 3 * tet_limit; ++step) {
    const int count = static_cast<int>(cubature.tets().size());
    job.report("cubature", static_cast<double>(count) / tet_limit);
    if (count >= tet_limit || !cubature.add_tet(job)) break;
    if (!any_tets || step % 5 != 4) continue;
    update(cubature);
    const Eigen::MatrixXd q =
        reduced_coordinates(result.rs_modes, result.map, result.direct, validation.z);
    result.met_limit = relative_errors(validation, q).mean() <= limit;
    if (result.met_limit) return result;
  }
  update(cubature);
  return result;
}

}  // namespace limber::reduced
