#pragma once

#include <Eigen/Core>

namespace limber::reduced {

/// Poses with their full reconstructions, seen through the basis: what cubature is trained and
/// judged on.
struct PoseData {
  Eigen::MatrixXd z;     // R x S, modal coordinates
  Eigen::MatrixXd q;     // h x S, B^T u
  Eigen::VectorXd norm;  // S, |u| > 0 [m]

  [[nodiscard]] int count() const { return static_cast<int>(z.cols()); }
};

/// Relative error of u in each pose if the reduced coordinates were q_hat: with B orthonormal,
/// |u - B q_hat|^2 = |u|^2 - |q|^2 + |q - q_hat|^2. Shapes agree; S values.
[[nodiscard]] inline Eigen::VectorXd relative_errors(const PoseData& poses,
                                                     const Eigen::MatrixXd& q_hat) {
  const Eigen::ArrayXd norm2 = poses.norm.array().square();
  const Eigen::ArrayXd outside =
      (norm2 - poses.q.colwise().squaredNorm().transpose().array()).max(0.0);
  const Eigen::ArrayXd inside = (poses.q - q_hat).colwise().squaredNorm().transpose().array();
  return ((outside + inside) / norm2).sqrt();
}

/// Mean over the poses of the relative error, for every basis size: entry h - 1 is that of the
/// first h rows.
[[nodiscard]] inline Eigen::VectorXd mean_error_by_size(const PoseData& poses,
                                                        const Eigen::MatrixXd& q_hat) {
  const Eigen::ArrayXd norm2 = poses.norm.array().square();
  Eigen::ArrayXd left = Eigen::ArrayXd::Ones(poses.count());  // |u - B_h q_hat_h|^2 / |u|^2
  Eigen::VectorXd result(poses.q.rows());
  for (Eigen::Index k = 0; k < poses.q.rows(); ++k) {
    const Eigen::ArrayXd row = poses.q.row(k).transpose().array();
    const Eigen::ArrayXd miss = row - q_hat.row(k).transpose().array();
    left += (miss.square() - row.square()) / norm2;
    result[k] = left.max(0.0).sqrt().mean();
  }
  return result;
}

}  // namespace limber::reduced
