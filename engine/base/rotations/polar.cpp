#include "engine/base/rotations/polar.h"

#include <Eigen/Eigenvalues>

#include "engine/base/error.h"

namespace limber::rotations {

Polar polar_decomposition(const Eigen::Matrix3d& f) {
  LIMBER_DEMAND(f.allFinite());
  const double scale = f.cwiseAbs().maxCoeff();
  if (scale == 0) return {Eigen::Quaterniond::Identity(), Eigen::Matrix3d::Zero()};
  const Eigen::Matrix3d g = f / scale;

  // tr(R(q)^T F) = q^T K q for a unit quaternion q = (w, v); its maximum is the nearest rotation
  // (Horn 1987).
  Eigen::Matrix4d k;
  const Eigen::Vector3d axial(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1));
  k(0, 0) = g.trace();
  k.block<3, 1>(1, 0) = axial;
  k.block<1, 3>(0, 1) = axial.transpose();
  k.block<3, 3>(1, 1) = g + g.transpose() - g.trace() * Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(k);
  const Eigen::Vector4d q = solver.eigenvectors().col(3);
  Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (rotation.w() < 0) rotation.coeffs() = -rotation.coeffs();
  rotation.normalize();

  const Eigen::Matrix3d product = rotation.toRotationMatrix().transpose() * f;
  return {rotation, 0.5 * (product + product.transpose())};
}

}  // namespace limber::rotations
