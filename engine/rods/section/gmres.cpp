#include "engine/rods/section/gmres.h"

#include <Eigen/Jacobi>
#include <vector>

namespace limber::rods {

Eigen::VectorXd gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& apply,
                      const Eigen::VectorXd& b, double tolerance) {
  const double size = b.norm();
  if (size == 0) return Eigen::VectorXd::Zero(b.size());
  constexpr int kMaxIterations = 400;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(kMaxIterations + 1, kMaxIterations);
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(kMaxIterations + 1);
  residual[0] = size;
  std::vector<Eigen::VectorXd> basis{b / size};
  std::vector<Eigen::JacobiRotation<double>> rotations;
  int k = 0;
  for (; k < kMaxIterations && std::abs(residual[k]) > tolerance * size; ++k) {
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
  return x;
}

}  // namespace limber::rods
