#include "engine/rods/section/gmres.h"

#include <Eigen/Jacobi>
#include <cmath>
#include <utility>
#include <vector>

namespace limber::rods {

GmresResult gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& apply,
                  const Eigen::VectorXd& b, double tolerance, int max_iterations) {
  const double size = b.norm();
  if (size == 0) return {Eigen::VectorXd::Zero(b.size()), 0, 0, true};
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(max_iterations + 1, max_iterations);
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(max_iterations + 1);
  residual[0] = size;
  std::vector<Eigen::VectorXd> basis{b / size};
  std::vector<Eigen::JacobiRotation<double>> rotations;
  int k = 0;
  for (; k < max_iterations && std::abs(residual[k]) > tolerance * size; ++k) {
    Eigen::VectorXd w = apply(basis[static_cast<std::size_t>(k)]);
    for (int pass = 0; pass < 2; ++pass) {  // twice is orthogonal to rounding
      for (int i = 0; i <= k; ++i) {
        const double c = basis[static_cast<std::size_t>(i)].dot(w);
        h(i, k) += c;
        w -= c * basis[static_cast<std::size_t>(i)];
      }
    }
    h(k + 1, k) = w.norm();
    for (int i = 0; i < k; ++i)
      h.col(k).applyOnTheLeft(i, i + 1, rotations[static_cast<std::size_t>(i)].adjoint());
    Eigen::JacobiRotation<double> rotation;
    const double next = h(k + 1, k);
    rotation.makeGivens(h(k, k), next, &h(k, k));
    h(k + 1, k) = 0;
    rotations.push_back(rotation);
    residual.applyOnTheLeft(k, k + 1, rotation.adjoint());
    if (next == 0) {
      ++k;
      break;
    }
    basis.push_back(w / next);
  }
  const Eigen::VectorXd y =
      h.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(residual.head(k));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  for (int i = 0; i < k; ++i) x += y[i] * basis[static_cast<std::size_t>(i)];
  const double reached = (b - apply(x)).norm() / size;
  const bool is_converged = std::abs(residual[k]) <= tolerance * size && x.allFinite();
  return {std::move(x), k, reached, is_converged};
}

}  // namespace limber::rods
