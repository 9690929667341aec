#include "engine/reduced/snapshot_basis.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"

namespace limber::reduced {
namespace {

/// X^T X by blocks of rows: poses are many rows long and few.
Eigen::MatrixXd gram_matrix(const Eigen::Ref<const Eigen::MatrixXd>& x) {
  constexpr Eigen::Index kRows = 2048;  // of one block
  const Eigen::Index blocks = (x.rows() + kRows - 1) / kRows;
  // A fixed number of partial sums: the result does not depend on the threads.
  constexpr int kParts = 8;
  std::vector<Eigen::MatrixXd> parts(kParts, Eigen::MatrixXd::Zero(x.cols(), x.cols()));
  parallel_for(kParts, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t part = begin; part < end; ++part) {
      for (Eigen::Index b = part; b < blocks; b += kParts) {
        const auto rows = x.middleRows(b * kRows, std::min(kRows, x.rows() - b * kRows));
        parts[part].selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
      }
    }
  });
  for (int part = 1; part < kParts; ++part) parts[0] += parts[part];
  return parts[0].selfadjointView<Eigen::Lower>();
}

/// Q of a QR decomposition with positive diagonal of R, by Cholesky of the Gram matrix, twice, in
/// parallel. @returns false, with unchanged columns, if they depend on each other too much
bool orthonormalise_by_cholesky(Eigen::MatrixXd& b) {
  constexpr double kLeastPivot = 1e-5;  // of unit columns: once more leaves rounding alone
  constexpr Eigen::Index kRows = 2048;  // of one block
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::LLT<Eigen::MatrixXd> cholesky(gram_matrix(b));
    if (cholesky.info() != Eigen::Success) return false;
    const Eigen::MatrixXd lower = cholesky.matrixL();
    if (pass == 0 && !(lower.diagonal().minCoeff() > kLeastPivot)) return false;
    const Eigen::MatrixXd inverse = lower.transpose().triangularView<Eigen::Upper>().solve(
        Eigen::MatrixXd::Identity(b.cols(), b.cols()));
    parallel_for((b.rows() + kRows - 1) / kRows, 1, [&](std::int64_t block, std::int64_t) {
      const Eigen::Index first = block * kRows, n = std::min(kRows, b.rows() - first);
      b.middleRows(first, n) = (b.middleRows(first, n) * inverse).eval();
    });
  }
  return true;
}

/// Of unit columns.
void orthonormalise(Eigen::MatrixXd& b) {
  if (orthonormalise_by_cholesky(b)) return;
  // Signs of R made positive: columns keep their original direction.
  const Eigen::VectorXd diagonal = orthonormalise_columns(b);
  for (Eigen::Index k = 0; k < b.cols(); ++k) {
    if (diagonal[k] < 0) b.col(k) = -b.col(k);
  }
}

}  // namespace

Eigen::MatrixXd snapshot_basis(const Eigen::Ref<const Eigen::MatrixXd>& u,
                               const Eigen::VectorXd& node_mass,
                               const Eigen::Ref<const Eigen::MatrixXd>& exact, int size,
                               FieldScaling scaling) {
  // Share of the largest singular value: smaller ones are dropped. Share of columns: shorter ones
  // depend on others.
  constexpr double kSmallest = 1e-7, kRounding = 1e-12;
  const Eigen::Index rows = u.rows();
  LIMBER_DEMAND(rows == 3 * node_mass.size() && size > exact.cols() && rows >= exact.cols());
  Eigen::VectorXd root(rows);
  for (Eigen::Index i = 0; i < node_mass.size(); ++i)
    root.segment<3>(3 * i).setConstant(std::sqrt(node_mass[i]));

  Eigen::MatrixXd fixed = root.asDiagonal() * exact;
  for (Eigen::Index k = 0; k < fixed.cols(); ++k) fixed.col(k).normalize();
  if (fixed.cols() > 0) orthonormalise(fixed);
  Eigen::MatrixXd x(rows, u.cols());
  parallel_for(u.cols(), 16, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t s = begin; s < end; ++s) {
      x.col(s) = root.cwiseProduct(u.col(s));
      const double whole = x.col(s).norm();
      if (fixed.cols() > 0) x.col(s) -= fixed * (fixed.transpose() * x.col(s)).eval();
      const double norm = x.col(s).norm();
      // If the exact fields span a pose, its remainder is rounding, not a direction.
      const double length = scaling == FieldScaling::kUnit ? norm : 1;
      x.col(s) *= norm > kRounding * whole ? 1 / length : 0;
    }
  });

  // Eigenvectors of the Gram matrix give the left singular vectors down to sqrt(eps), ample for a
  // basis.
  const SymmetricEigen solver(gram_matrix(x));
  const Eigen::VectorXd& values = solver.eigenvalues();  // ascending
  const double largest = values[values.size() - 1];
  Eigen::Index count = 0;
  const Eigen::Index room = std::min({size - exact.cols(), values.size(), rows - exact.cols()});
  while (count < room && values[values.size() - 1 - count] > kSmallest * kSmallest * largest)
    ++count;

  Eigen::MatrixXd basis(rows, exact.cols() + count);
  basis.leftCols(exact.cols()) = exact;
  const Eigen::MatrixXd weights = solver.eigenvectors().rightCols(count).rowwise().reverse();
  constexpr Eigen::Index kRows = 1024;  // of one block
  parallel_for((rows + kRows - 1) / kRows, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t block = begin; block < end; ++block) {
      const Eigen::Index first = block * kRows, n = std::min(kRows, rows - block * kRows);
      basis.block(first, exact.cols(), n, count).noalias() =
          root.segment(first, n).cwiseInverse().asDiagonal() *
          (x.middleRows(first, n) * weights).eval();
    }
  });
  for (Eigen::Index k = 0; k < basis.cols(); ++k) basis.col(k).normalize();
  orthonormalise(basis);
  return basis;
}

}  // namespace limber::reduced
