#include "engine/rods/solver/bordered_solver.h"

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"

namespace limber::rods {
namespace {

// Eigenvalues of the small system below this share of the largest are rounding noise.
constexpr double kDependent = 1e-13;

}  // namespace

BorderedSolver::BorderedSolver(CondensedSolver& solver,
                               const Eigen::Ref<const Eigen::MatrixXd>& rows,
                               const Eigen::Ref<const Eigen::VectorXd>& compliance)
    : solver_(solver), columns_(rows.transpose()), answers_(columns_) {
  LIMBER_DEMAND(rows.cols() == solver.size() && compliance.size() == rows.rows());
  for (Eigen::Index k = 0; k < answers_.cols(); ++k) solver_.solve_in_place(answers_.col(k));
  negative_ = solver_.pivots().negative;
  if (rows.rows() == 0) return;
  // Few and long: by dot products, nothing is packed.
  Eigen::MatrixXd small = compliance.asDiagonal();
  for (Eigen::Index i = 0; i < small.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      small(i, j) +=
          0.5 * (columns_.col(i).dot(answers_.col(j)) + columns_.col(j).dot(answers_.col(i)));
      small(j, i) = small(i, j);
    }
  }
  // Rows of different units: an angle, a position, a mean over hundreds of angles.
  const SymmetricEigen eigen(small);
  values_ = eigen.eigenvalues();
  vectors_ = eigen.eigenvectors();
  const double largest = values_.cwiseAbs().maxCoeff();
  int turned = 0;
  for (const double value : values_) {
    if (!(std::abs(value) > kDependent * largest)) {
      throw Error(ErrorCode::kNumerical, "rows",
                  "the rows depend on each other: their forces are not determined");
    }
    turned += value < 0 ? 1 : 0;
  }
  // Eigenvalues of the whole: those of H and of -(C + A H^-1 A^T); of them k negative ones belong
  // to the rows.
  negative_ -= turned;
}

bool BorderedSolver::positive_definite() const {
  return negative_ == 0 && solver_.pivots().vanishing == 0;
}

void BorderedSolver::solve_in_place(Eigen::Ref<Eigen::VectorXd> b,
                                    Eigen::Ref<Eigen::VectorXd> c) const {
  LIMBER_DEMAND(b.size() == columns_.rows() && c.size() == columns_.cols());
  solver_.solve_in_place(b);
  if (columns_.cols() == 0) return;
  for (Eigen::Index k = 0; k < c.size(); ++k) c[k] = columns_.col(k).dot(b) - c[k];
  c = (vectors_ * (vectors_.transpose() * c).cwiseQuotient(values_)).eval();
  for (Eigen::Index k = 0; k < c.size(); ++k) b -= c[k] * answers_.col(k);
}

}  // namespace limber::rods
