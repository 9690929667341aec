#include "engine/reduced/weighted_cubature.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "engine/base/numerics/nnls.h"
#include "engine/base/parallel.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced {
namespace {

constexpr int kCandidates = 200;  // per step, as the paper's authors: 100 to 300
constexpr double kSmallestWeight =
    1e-6;  // of a weight that counts; weights of an exact sum are one

/// B^T A B without forming A: sum over tets of V (G_e B)^T (G_e B).
Eigen::MatrixXd reduced_laplacian(const bodies::GradientOperator& gradient,
                                  const Eigen::MatrixXd& basis) {
  const Eigen::SparseMatrix<double> laplacian = gradient.scalar_laplacian();
  const Eigen::Index n = laplacian.rows(), h = basis.cols();
  Eigen::MatrixXd image(basis.rows(), h);
  for (Eigen::Index k = 0; k < h; ++k) {
    const Eigen::Map<const Eigen::Matrix3Xd> field(basis.col(k).data(), 3, n);
    Eigen::Map<Eigen::Matrix3Xd>(image.col(k).data(), 3, n).transpose() =
        laplacian * field.transpose();
  }
  return basis.transpose() * image;
}

}  // namespace

WeightedCubature::WeightedCubature(const bodies::GradientOperator& gradient,
                                   const Eigen::MatrixXd& modes, const Eigen::MatrixXd& basis,
                                   const Eigen::VectorXd& node_share, const PoseData& train,
                                   std::uint64_t seed)
    : gradient_(gradient), modes_(modes), basis_(basis), train_(train), random_(seed) {
  const Eigen::Index h = basis.cols();
  const Eigen::MatrixXd laplacian = reduced_laplacian(gradient, basis);
  solve_ = Eigen::MatrixXd::Zero(h, h);
  if (node_share.size() == 0) {
    solve_ = laplacian.ldlt().solve(Eigen::MatrixXd::Identity(h, h));
  } else {
    // Translations are the kernel of A: the rest is solved for, then the centre of mass is put back
    // where it was.
    const Eigen::Index rest = h - 3;
    solve_.bottomRightCorner(rest, rest) =
        laplacian.bottomRightCorner(rest, rest).ldlt().solve(Eigen::MatrixXd::Identity(rest, rest));
    Eigen::MatrixXd mean(3, h);
    for (int axis = 0; axis < 3; ++axis) {
      // Rows 3 node + axis of B, weighed.
      mean.row(axis).setZero();
      for (Eigen::Index i = 0; i < node_share.size(); ++i) {
        mean.row(axis) += node_share[i] * basis.row(3 * i + axis);
      }
    }
    const Eigen::Matrix3d own = mean.leftCols<3>();
    solve_.topRightCorner(3, rest) =
        -own.inverse() * mean.rightCols(rest) * solve_.bottomRightCorner(rest, rest);
  }
  target_.resize(h * train.count());
  Eigen::Map<Eigen::MatrixXd>(target_.data(), h, train.count()) =
      train.q * train.norm.cwiseInverse().asDiagonal();
  residual_ = target_;
  unused_.resize(gradient.tet_count());
  for (int e = 0; e < gradient.tet_count(); ++e) unused_[e] = e;
}

Eigen::MatrixXd WeightedCubature::projection(int tet) const {
  // Rows of B^T G_e^T: gradients of the basis fields in this tet.
  Eigen::MatrixXd fields(basis_.cols(), kRsSize);
  for (Eigen::Index k = 0; k < basis_.cols(); ++k) {
    const Eigen::Matrix3d g = gradient_.apply(basis_.col(k), tet);
    fields.row(k) = Eigen::Map<const RsVector>(g.data()).transpose();
  }
  return gradient_.volumes()[tet] * (solve_ * fields);
}

Eigen::VectorXd WeightedCubature::column(int tet) const {
  const Eigen::MatrixXd y = linear_coordinates(gradient_, {tet}, modes_) * train_.z;
  Eigen::MatrixXd g(kRsSize, y.cols());
  for (Eigen::Index s = 0; s < y.cols(); ++s) {
    const Eigen::Matrix3d g_s = displacement_gradient(y.col(s));
    g.col(s) = Eigen::Map<const RsVector>(g_s.data()) / train_.norm[s];
  }
  Eigen::VectorXd result(target_.size());
  Eigen::Map<Eigen::MatrixXd>(result.data(), basis_.cols(), train_.count()).noalias() =
      projection(tet) * g;
  return result;
}

bool WeightedCubature::add_tet(const JobContext& job) {
  if (unused_.empty()) return false;
  const int count = std::min<int>(kCandidates, static_cast<int>(unused_.size()));
  for (int k = 0; k < count; ++k) {
    std::swap(unused_[k], unused_[k + random_.index(unused_.size() - k)]);
  }
  std::vector<double> score(count);
  parallel_for(count, 8, [&](std::int64_t begin, std::int64_t end) {
    job.throw_if_cancelled();
    for (std::int64_t k = begin; k < end; ++k) {
      const Eigen::VectorXd a = column(unused_[k]);
      const double norm = a.norm();
      score[k] = norm > 0 ? a.dot(residual_) / norm : 0.0;
    }
  });
  const auto best = std::max_element(score.begin(), score.end()) - score.begin();
  const int tet = unused_[best];
  unused_.erase(unused_.begin() + best);

  const auto old = static_cast<Eigen::Index>(members_.size());
  members_.push_back(tet);
  columns_.conservativeResize(target_.size(), old + 1);
  columns_.col(old) = column(tet);
  gram_.conservativeResize(old + 1, old + 1);
  gram_.col(old) = columns_.transpose() * columns_.col(old);
  gram_.row(old) = gram_.col(old).transpose();
  rhs_.conservativeResize(old + 1);
  rhs_[old] = columns_.col(old).dot(target_);

  std::vector<int> support;
  for (Eigen::Index k = 0; k < old; ++k) {
    if (weights_[k] > 0) support.push_back(static_cast<int>(k));
  }
  weights_ = nnls(gram_, rhs_, {}, support).x;
  residual_ = target_ - columns_ * weights_;
  return true;
}

std::vector<int> WeightedCubature::tets() const {
  std::vector<int> result;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    if (weights_[static_cast<Eigen::Index>(k)] > kSmallestWeight) result.push_back(members_[k]);
  }
  return result;
}

Eigen::MatrixXd WeightedCubature::map() const {
  Eigen::MatrixXd result(basis_.cols(), kRsSize * static_cast<Eigen::Index>(tets().size()));
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const double weight = weights_[static_cast<Eigen::Index>(k)];
    if (weight <= kSmallestWeight) continue;
    result.middleCols<kRsSize>(at) = weight * projection(members_[k]);
    at += kRsSize;
  }
  return result;
}

}  // namespace limber::reduced
