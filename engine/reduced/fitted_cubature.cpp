#include "engine/reduced/fitted_cubature.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {
namespace {

constexpr int kPoolGrain = 16;  // tets of one parallel chunk
// Tets are ranked by the first so many training poses; maps are fitted to all. More poses make
// better maps, hardly better choices, as long as they outnumber the features.
constexpr int kRankingPoses = 1200;

/// Derivative of g at zero, 9 x 9: y -> the gradient whose parts are y.
Eigen::Matrix<double, 9, 9> linear_part() {
  Eigen::Matrix<double, 9, 9> result;
  for (int c = 0; c < kRsSize; ++c) {
    Eigen::Map<Eigen::Matrix3d>(result.col(c).data()) = linear_gradient(RsVector::Unit(c));
  }
  return result;
}

/// 9T x 9 (T - 1), orthonormal: blocks of nine whose sum over the T tets vanishes (Helmert).
Eigen::MatrixXd zero_sum_columns(Eigen::Index tets) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(kRsSize * tets, kRsSize * (tets - 1));
  for (Eigen::Index k = 1; k < tets; ++k) {
    const double share = 1 / std::sqrt(static_cast<double>(k * (k + 1)));
    for (Eigen::Index t = 0; t <= k; ++t) {
      const double weight = t < k ? share : -static_cast<double>(k) * share;
      for (int c = 0; c < kRsSize; ++c) result(kRsSize * t + c, kRsSize * (k - 1) + c) = weight;
    }
  }
  return result;
}

}  // namespace

Eigen::MatrixXd remainder_features(const Eigen::MatrixXd& rs_modes, const Eigen::MatrixXd& z) {
  const Eigen::MatrixXd y = z.transpose() * rs_modes.transpose();  // S x 9
  Eigen::MatrixXd features(y.rows(), kRsSize);
  for (Eigen::Index s = 0; s < y.rows(); ++s) {
    const RsVector y_s = y.row(s);
    double r[kRsSize];
    rs_remainder_entries(y_s.data(), r);
    for (int c = 0; c < kRsSize; ++c) features(s, c) = r[c];
  }
  return features;
}

FittedCubature::FittedCubature(const bodies::GradientOperator& gradient,
                               const Eigen::MatrixXd& modes, Eigen::MatrixXd linear,
                               const PoseData& train, const PoseData& validation,
                               std::vector<int> pool, Eigen::MatrixXd affine)
    : gradient_(gradient),
      modes_(modes),
      linear_(std::move(linear)),
      affine_(std::move(affine)),
      train_(train),
      validation_(validation),
      pool_(std::move(pool)),
      rs_modes_(0, modes.cols()),
      features_(train.count(), 0),
      gram_(0, 0),
      cross_(0, linear_.rows()),
      validation_features_(validation.count(), 0) {
  const Eigen::VectorXd weight = train.norm.cwiseInverse();
  target_ = weight.asDiagonal() * (train.q - linear_ * train.z).transpose();
  const int ranking = std::min(train.count(), kRankingPoses);
  const Eigen::MatrixXd z = train.z.leftCols(ranking);
  residual_ = target_.topRows(ranking);
  pool_features_.resize(ranking, kRsSize * static_cast<Eigen::Index>(pool_.size()));
  parallel_for(static_cast<std::int64_t>(pool_.size()), kPoolGrain,
               [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t c = begin; c < end; ++c) {
                   const Eigen::MatrixXd y = linear_coordinates(gradient_, {pool_[c]}, modes_);
                   pool_features_.middleCols<kRsSize>(kRsSize * c) =
                       weight.head(ranking).asDiagonal() * remainder_features(y, z);
                 }
               });
  noise_floor_ = 1e-5 * pool_features_.squaredNorm() /
                 static_cast<double>(std::max<Eigen::Index>(1, pool_features_.cols()));
}

bool FittedCubature::add_best_tet(const JobContext& job) {
  const auto count = static_cast<std::int64_t>(pool_.size());
  std::vector<double> score(pool_.size(), 0);
  parallel_for(count, kPoolGrain, [&](std::int64_t begin, std::int64_t end) {
    job.throw_if_cancelled();
    // One product for the chunk: nine rows at a time would mostly pack the residual.
    const Eigen::MatrixXd along =
        pool_features_.middleCols(kRsSize * begin, kRsSize * (end - begin)).transpose() * residual_;
    for (std::int64_t c = begin; c < end; ++c) {
      const auto phi = pool_features_.middleCols<kRsSize>(kRsSize * c);
      Eigen::Matrix<double, 9, 9> gram = phi.transpose() * phi;
      gram.diagonal().array() += noise_floor_;
      // The gain of a regression on these nine features alone: |L^-1 phi^T residual|^2.
      Eigen::MatrixXd projection = along.middleRows<kRsSize>(kRsSize * (c - begin));
      gram.llt().matrixL().solveInPlace(projection);
      score[c] = projection.squaredNorm();
    }
  });
  const auto best = std::max_element(score.begin(), score.end());
  if (best == score.end() || !(*best > 0)) return false;
  const auto chosen = best - score.begin();
  append_features(pool_[chosen]);

  // Directions of the chosen tet with more than noise in them, orthonormal.
  const Eigen::MatrixXd phi = pool_features_.middleCols<kRsSize>(kRsSize * chosen);
  const SymmetricEigen solver(phi.transpose() * phi);
  Eigen::Index kept = 0;
  while (kept < kRsSize && solver.eigenvalues()[kRsSize - 1 - kept] > noise_floor_) ++kept;
  const Eigen::MatrixXd direction =
      phi * (solver.eigenvectors().rightCols(kept) *
             solver.eigenvalues().tail(kept).cwiseSqrt().cwiseInverse().asDiagonal());
  residual_ -= direction * (direction.transpose() * residual_).eval();
  parallel_for(count, kPoolGrain, [&](std::int64_t begin, std::int64_t end) {
    auto block = pool_features_.middleCols(kRsSize * begin, kRsSize * (end - begin));
    const Eigen::MatrixXd along = direction.transpose() * block;
    block.noalias() -= direction * along;
  });
  return true;
}

void FittedCubature::append_features(int tet) {
  const Eigen::Index old = features_.cols();
  tets_.push_back(tet);
  const Eigen::MatrixXd y = linear_coordinates(gradient_, {tet}, modes_);
  rs_modes_.conservativeResize(old + kRsSize, Eigen::NoChange);
  rs_modes_.bottomRows<kRsSize>() = y;
  features_.conservativeResize(Eigen::NoChange, old + kRsSize);
  features_.rightCols<kRsSize>() =
      train_.norm.cwiseInverse().asDiagonal() * remainder_features(y, train_.z);
  const auto added = features_.rightCols<kRsSize>();
  gram_.conservativeResize(old + kRsSize, old + kRsSize);
  gram_.rightCols<kRsSize>().noalias() = features_.transpose() * added;
  gram_.bottomLeftCorner(kRsSize, old) = gram_.topRightCorner(old, kRsSize).transpose();
  cross_.conservativeResize(old + kRsSize, Eigen::NoChange);
  cross_.bottomRows<kRsSize>().noalias() = added.transpose() * target_;
  validation_features_.conservativeResize(Eigen::NoChange, old + kRsSize);
  validation_features_.rightCols<kRsSize>() = remainder_features(y, validation_.z);
}

FittedCubature::Fit FittedCubature::fit() const {
  const auto tets = static_cast<Eigen::Index>(tets_.size());
  Eigen::MatrixXd gram = gram_, cross = cross_;
  Eigen::MatrixXd probe = validation_features_;  // S' x 9T
  Eigen::MatrixXd base = linear_ * validation_.z;
  Eigen::MatrixXd constant = Eigen::MatrixXd::Zero(target_.cols(), kRsSize * tets);
  Eigen::MatrixXd differences;
  if (affine_.size() > 0) {
    // H_e = A / T + what sums to zero; only the latter is free.
    constant = affine_.replicate(1, tets) / static_cast<double>(tets);
    differences = zero_sum_columns(tets);
    cross -= gram * constant.transpose();
    base += constant * probe.transpose();
    gram = (differences.transpose() * gram * differences).eval();
    cross = (differences.transpose() * cross).eval();
    probe = (probe * differences).eval();
  }
  Fit best;
  if (gram.size() == 0) {
    best.map = constant;
    best.validation_mean = mean_error_by_size(validation_, base);
    return best;
  }
  const SymmetricEigen solver(gram);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0.0);
  const double largest = values.maxCoeff();
  const Eigen::MatrixXd& vectors = solver.eigenvectors();
  const Eigen::MatrixXd right = vectors.transpose() * cross;
  probe = (probe * vectors).eval();

  double best_error = 0;
  Eigen::MatrixXd free;
  for (int exponent = -22; exponent <= -4; ++exponent) {
    const double ridge = std::pow(10.0, 0.5 * exponent);
    const Eigen::VectorXd inverse = (values.array() + ridge * largest).inverse();
    const Eigen::MatrixXd scaled = inverse.asDiagonal() * right;
    const Eigen::MatrixXd q_hat = base + (probe * scaled).transpose();
    const Eigen::VectorXd errors = mean_error_by_size(validation_, q_hat);
    const double error = errors[errors.size() - 1];
    if (free.size() == 0 || error < best_error) {
      best_error = error;
      free = scaled;
      best.ridge = ridge;
      best.validation_mean = errors;
    }
  }
  free = (vectors * free).eval();
  if (differences.size() > 0) free = (differences * free).eval();
  best.map = constant + free.transpose();
  return best;
}

Eigen::MatrixXd FittedCubature::direct(const Eigen::MatrixXd& map) const {
  Eigen::MatrixXd result = linear_.topRows(map.rows());
  static const Eigen::Matrix<double, 9, 9> kLinear = linear_part();
  for (Eigen::Index first = 0; first < map.cols(); first += kRsSize) {
    result.noalias() -=
        map.middleCols<kRsSize>(first) * (kLinear * rs_modes_.middleRows<kRsSize>(first));
  }
  return result;
}

}  // namespace limber::reduced
