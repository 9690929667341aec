#include "engine/base/numerics/dense.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>

namespace limber {

SymmetricEigen::SymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

SymmetricEigen::SymmetricEigen(const Eigen::Ref<const Eigen::VectorXd>& diagonal,
                               const Eigen::Ref<const Eigen::VectorXd>& beside) {
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, beside);
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

GeneralizedSymmetricEigen::GeneralizedSymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(a, b);
  has_converged_ = solver.info() == Eigen::Success;
  if (!has_converged_) return;
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

ThinSvd thin_svd(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Eigen::VectorXd orthonormalise_columns(Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(matrix);
  Eigen::VectorXd diagonal = qr.matrixQR().diagonal();
  matrix =
      Eigen::MatrixXd(qr.householderQ() * Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
  return diagonal;
}

Eigen::VectorXd rotate_by_qr(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                             const Eigen::Ref<const Eigen::VectorXd>& v) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  return qr.householderQ().transpose() * v;
}

Eigen::VectorXd PivotedQr::permuted(const Eigen::Ref<const Eigen::VectorXd>& v) const {
  Eigen::VectorXd result(v.size());
  for (Eigen::Index i = 0; i < v.size(); ++i) result[i] = v[columns[i]];
  return result;
}

PivotedQr pivoted_qr(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix);
  const Eigen::Index rows = std::min(matrix.rows(), matrix.cols());
  return {qr.matrixR().topRows(rows).template triangularView<Eigen::Upper>(),
          qr.colsPermutation().indices()};
}

Eigen::MatrixXd orthonormal_range(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                  double threshold) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix.rows(), matrix.cols());
  qr.setThreshold(threshold);
  qr.compute(matrix);
  return qr.householderQ() * Eigen::MatrixXd::Identity(matrix.rows(), qr.rank());
}

}  // namespace limber
