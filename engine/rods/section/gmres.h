#pragma once

#include <Eigen/Core>
#include <functional>

namespace limber::rods {

struct GmresResult {
  Eigen::VectorXd x;
  int iterations = 0;            // products with A, without the one that checks x
  double relative_residual = 0;  // |b - A x| / |b|, computed from x
  /// x is finite and the iteration's own estimate of its residual within the tolerance.
  bool is_converged = false;
};

/// A x = b by GMRES without restarts, for operators that are a small part away from a multiple of
/// the identity. Stops if the estimate of |b - A x| is at most tolerance |b|, if the Krylov space
/// is exhausted, or after max_iterations. The result says which x was reached, and the caller
/// decides whether that is close enough.
/// @param b  n numbers; zero gives x = 0
/// @param max_iterations  > 0; so many vectors of n numbers are held
[[nodiscard]] GmresResult gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& apply,
                                const Eigen::VectorXd& b, double tolerance,
                                int max_iterations = 400);

}  // namespace limber::rods
