#include "engine/spacetime/constraint_system.h"

#include <Eigen/Cholesky>

#include "engine/base/error.h"

namespace limber::spacetime {

void response_of_rows(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
                      Lanes& scaled, Eigen::MatrixXd& system) {
  const int n = rows.count();
  const int lanes = systems.lanes();
  const int knots = static_cast<int>(rows.knots().size());
  system.resize(n, n);
  scaled.resize(lanes, n);
  for (int knot = 0; knot < knots; ++knot) {
    const int first = rows.first_row(knot), last = rows.first_row(knot + 1);
    for (int other = 0; other <= knot; ++other) {
      const double* __restrict green = systems.green(knot, other);
      for (int column = rows.first_row(other); column < rows.first_row(other + 1); ++column) {
        const double* j = jacobian.col(column).data();
        double* __restrict out = scaled.col(column).data();
        for (int k = 0; k < lanes; ++k) out[k] = green[k] * j[k];
      }
    }
    system.block(first, 0, last - first, last).noalias() =
        jacobian.middleCols(first, last - first).transpose() * scaled.leftCols(last);
  }
}

void factor_lifted(Eigen::MatrixXd& system, Eigen::MatrixXd& work) {
  const Eigen::VectorXd diagonal = system.diagonal();
  const double largest = diagonal.size() > 0 ? diagonal.maxCoeff() : 0;
  double lift = 0;
  for (int attempt = 0; attempt < 12; ++attempt) {
    work = system;
    work.diagonal().array() += lift * largest;
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(work);
    if (llt.info() == Eigen::Success) {
      system.swap(work);
      return;
    }
    lift = lift == 0 ? 1e-15 : lift * 10;
  }
  throw Error(ErrorCode::kNumerical, "",
              "the constraints' system cannot be factored: displacements or their Jacobians are "
              "not finite");
}

}  // namespace limber::spacetime
