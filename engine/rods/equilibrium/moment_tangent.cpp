#include "engine/rods/equilibrium/moment_tangent.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>

#include "engine/base/error.h"
#include "engine/base/rotations/exponential_map.h"

namespace limber::rods::detail {
namespace {

constexpr Eigen::Index kMaxColumns = 200;
constexpr Eigen::Index kColumnsBetweenChecks = 8;
constexpr double kSettledEigenvalue = 1e-6;  // residual of an eigenvalue, as a share of it
constexpr double kDependentColumn = 1e-10;   // new part of one, as a share of it

/// Vectors that are orthonormal by E, and their products with H^-1 E: each in turn makes the next.
class KrylovBasis {
 public:
  KrylovBasis(const HessianFactor& factor, const MomentTangent::Metric& metric)
      : factor_(factor),
        metric_(metric),
        columns_(metric.diagonal.size(), std::min(kMaxColumns, metric.diagonal.size())),
        products_(Eigen::MatrixXd::Zero(columns_.cols(), columns_.cols())) {}

  [[nodiscard]] Eigen::Index size() const { return size_; }
  [[nodiscard]] bool is_full() const { return size_ == columns_.cols(); }
  [[nodiscard]] auto columns(Eigen::Index count) const { return columns_.leftCols(count); }
  /// H^-1 E by the basis: rows are its vectors, columns those that have been multiplied.
  [[nodiscard]] auto products(Eigen::Index count) const {
    return products_.topLeftCorner(size_, count);
  }

  /// @returns a vector by the basis, to which its new part has been added if there is room
  Eigen::VectorXd add(Eigen::VectorXd v) {
    Eigen::VectorXd along = Eigen::VectorXd::Zero(columns_.cols());
    const double all = size_of(v);
    for (int again = 0; again < 2; ++again) {
      const Eigen::VectorXd part = columns(size_).transpose() * weighed(v);
      v -= columns(size_) * part;
      along.head(size_) += part;
    }
    const double left = size_of(v);
    if (is_full() || !(left > kDependentColumn * all)) return along;
    columns_.col(size_) = v / left;
    along[size_++] = left;
    return along;
  }

  void multiply(Eigen::Index k) {
    Eigen::VectorXd v = weighed(columns_.col(k));
    factor_.solve_in_place(v);
    products_.col(k) = add(std::move(v));
  }

 private:
  /// E v without the held unknowns.
  [[nodiscard]] Eigen::VectorXd weighed(const Eigen::Ref<const Eigen::VectorXd>& v) const {
    Eigen::VectorXd result(v.size());
    metric_.stiffness.multiply(v, result);
    result += metric_.diagonal.cwiseProduct(v);
    return result;
  }
  [[nodiscard]] double size_of(const Eigen::VectorXd& v) const {
    return std::sqrt(std::max(0.0, v.dot(weighed(v))));
  }

  const HessianFactor& factor_;
  const MomentTangent::Metric& metric_;
  Eigen::MatrixXd columns_, products_;
  Eigen::Index size_ = 0;
};

/// Eigenvalues whose inverses have real parts below a bound <= 0.
/// @param left  remainders of its products outside the space
/// @returns nothing while one of them is not settled
std::optional<int> count_below(double bound, const Eigen::MatrixXd& matrix,
                               const Eigen::MatrixXd& left) {
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(matrix);
  const Eigen::MatrixXcd vectors = eigen.eigenvectors();
  int count = 0;
  for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
    const std::complex<double> value = eigen.eigenvalues()[k];
    if (!(value.real() < bound * std::norm(value))) continue;
    const double residual = (left * vectors.col(k)).norm() / vectors.col(k).norm();
    if (!(residual <= kSettledEigenvalue * std::abs(value))) return {};
    ++count;
  }
  return count;
}

}  // namespace

MomentTangent::MomentTangent(const HessianFactor& factor, const std::vector<int>& rotations,
                             const Eigen::VectorXd& moments)
    : factor_(factor), rotations_(rotations) {
  LIMBER_DEMAND(rotations.size() <= std::size_t{kMaxJoints});
  const auto size = 3 * static_cast<Eigen::Index>(rotations.size());
  skew_.setZero(size, size);
  answers_.setZero(moments.size(), size);
  for (Eigen::Index k = 0; k < size; ++k) {
    const int unknown = rotations[static_cast<std::size_t>(k / 3)] + static_cast<int>(k % 3);
    answers_(unknown, k) = 1;
    factor_.solve_in_place(answers_.col(k));
    if (k % 3 == 0)
      skew_.block<3, 3>(k, k) = -0.5 * rotations::cross_matrix(moments.segment<3>(unknown));
  }
  const Eigen::PartialPivLU<Eigen::MatrixXd> whole(Eigen::MatrixXd::Identity(size, size) +
                                                   skew_ * at_rotations(answers_));
  ratio_ = whole.determinant();
  small_ = whole.solve(skew_);
}

Eigen::MatrixXd MomentTangent::at_rotations(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  Eigen::MatrixXd result(3 * static_cast<Eigen::Index>(rotations_.size()), x.cols());
  for (std::size_t j = 0; j < rotations_.size(); ++j)
    result.middleRows<3>(3 * static_cast<Eigen::Index>(j)) = x.middleRows<3>(rotations_[j]);
  return result;
}

void MomentTangent::solve_in_place(Eigen::Ref<Eigen::VectorXd> b, Eigen::VectorXd rows) const {
  factor_.bordered->solve_in_place(b, rows);
  const Eigen::VectorXd change = small_ * at_rotations(b);
  b -= answers_ * change;
}

/// For a basis Q with products H^-1 E Q = Q T + left and Z = Q R, K x = lambda E x for x = Q y is
///   (I + R B (Q at rotations)) y = lambda T y.
std::optional<int> MomentTangent::unstable(const Metric& metric) const {
  KrylovBasis basis(factor_, metric);
  Eigen::MatrixXd answers(basis.products(0).rows(), 0);
  for (Eigen::Index k = 0; k < answers_.cols(); ++k) {
    const Eigen::VectorXd along = basis.add(answers_.col(k));
    answers.conservativeResizeLike(Eigen::MatrixXd::Zero(along.size(), k + 1));
    answers.col(k) = along;
  }
  const auto count_in = [&](Eigen::Index size) -> std::optional<int> {
    const Eigen::MatrixXd all = basis.products(size);
    const Eigen::MatrixXd products = all.topRows(size), left = all.bottomRows(all.rows() - size);
    const Eigen::PartialPivLU<Eigen::MatrixXd> tangent(Eigen::MatrixXd::Identity(size, size) +
                                                       answers.topRows(size) * skew_ *
                                                           at_rotations(basis.columns(size)));
    const auto without = count_below(0, products, left);
    const auto with = count_below(-metric.taken, tangent.solve(products), left);
    if (!without || !with) return {};
    return factor_.bordered->negative() - *without + *with;
  };
  // The sign of the determinant, det K = det H (det K / det H).
  const bool is_odd = (factor_.bordered->negative() % 2 != 0) != (ratio_ < 0);
  const Eigen::Index first = basis.size();
  std::optional<int> before;
  for (Eigen::Index k = 0; k < basis.size(); ++k) {
    if (basis.is_full()) break;
    basis.multiply(k);
    const bool is_whole = k + 1 == basis.size();
    if (k + 1 < first || (!is_whole && (k + 1 - first) % kColumnsBetweenChecks != 0)) continue;
    const std::optional<int> count = count_in(k + 1);
    const bool is_settled = count && (count == before || is_whole);
    if (is_settled && (metric.taken > 0 || (*count % 2 != 0) == is_odd)) return count;
    before = count;
  }
  return {};
}

}  // namespace limber::rods::detail
