#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/base/job.h"
#include "engine/base/numerics/sparse_cholesky.h"

namespace limber::beams::detail {

/// A direction v and how a symmetric matrix A curves along it.
struct CurvedDirection {
  double quotient = 0;  // v^T A v / v^T B v, for the B of the call
  Eigen::VectorXd direction;
};

/// The direction of the smallest quotient of A over B: Lanczos' method on B^-1 A.
///
/// A and B have the same signs of eigenvalues, B being positive definite. Take the stiffness for A,
/// and the same without compression for B. Quotients are then 1 where nothing is pressed and 1 - p
/// where a part carries p times its buckling load. The lowest stand apart, however much softer
/// other parts are that carry nothing.
///
/// Quotients are at least the smallest one; below zero they prove that A is not positive definite.
/// @param lower  lower triangle of A
/// @param factor  of B
/// @param weights  positive; scales of the directions with which the search begins
[[nodiscard]] CurvedDirection lowest_quotient(const Eigen::SparseMatrix<double>& lower,
                                              const SparseCholesky& factor,
                                              const Eigen::VectorXd& weights,
                                              const JobContext& context);

/// The stiffness at a state by its L D L^T, without exchanges.
struct Inertia {
  int negative = 0;           // eigenvalues
  Eigen::VectorXd direction;  // along which the stiffness is negative; empty where there is none
};
/// @param lower  lower triangle
/// @param noise  added to the diagonal, so that zeros are not taken for negative
[[nodiscard]] Inertia inertia_of(const Eigen::SparseMatrix<double>& lower,
                                 const Eigen::VectorXd& noise, const JobContext& context);

}  // namespace limber::beams::detail
