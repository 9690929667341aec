#include "tests/support/dense.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>

namespace limber::reference {

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

int negative_eigenvalues(const Eigen::MatrixXd& matrix) {
  return static_cast<int>((symmetric_eigenvalues(matrix).array() < 0).count());
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(a, b, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

bool is_positive_definite(const Eigen::MatrixXd& matrix) {
  return Eigen::LLT<Eigen::MatrixXd>(matrix).info() == Eigen::Success;
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return Eigen::LDLT<Eigen::MatrixXd>(matrix).solve(right);
}

Eigen::MatrixXd kernel(const Eigen::MatrixXd& matrix) {
  const Eigen::MatrixXd q =
      Eigen::HouseholderQR<Eigen::MatrixXd>(matrix.transpose()).householderQ();
  return q.rightCols(matrix.cols() - matrix.rows());
}

ThinQr::ThinQr(const Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  q_.setIdentity(matrix.rows(), matrix.cols());
  q_.applyOnTheLeft(qr.householderQ());
  r_ = qr.matrixQR().topRows(matrix.cols()).triangularView<Eigen::Upper>();
}

Eigen::VectorXd ThinQr::least_squares(const Eigen::VectorXd& right) const {
  Eigen::VectorXd x = q_.transpose() * right;
  r_.triangularView<Eigen::Upper>().solveInPlace(x);
  return x;
}

Svd3 svd(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Eigen::Vector3d singular_values(const Eigen::Matrix3Xd& points) {
  return svd(ThinQr(points.transpose()).r()).values;  // those of R^T Q^T are those of R
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized(), axis = a.cross(b);
  return Eigen::Quaterniond(1 + a.dot(b), axis.x(), axis.y(), axis.z()).normalized();
}

LongVector solve_in_long_double(const LongMatrix& matrix, const LongVector& right) {
  return Eigen::FullPivLU<LongMatrix>(matrix).solve(right);
}

LongVector least_squares_in_long_double(const LongMatrix& matrix, const LongVector& right) {
  return Eigen::HouseholderQR<LongMatrix>(matrix).solve(right);
}

struct SparseLdlt::Factor {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt;
};

SparseLdlt::SparseLdlt(const Eigen::SparseMatrix<double>& matrix) {
  const auto factor = std::make_shared<Factor>();
  factor->ldlt.compute(matrix);
  factor_ = factor;
}

bool SparseLdlt::has_factor() const { return factor_->ldlt.info() == Eigen::Success; }

Eigen::VectorXd SparseLdlt::pivots() const { return factor_->ldlt.vectorD(); }

Eigen::MatrixXd SparseLdlt::solve(const Eigen::MatrixXd& right) const {
  return factor_->ldlt.solve(right);
}

}  // namespace limber::reference
