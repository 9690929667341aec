#include "engine/base/rotations/rotated_vector.h"

namespace limber::rotations {

namespace {

Vec3<double> vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Matrix3d matrix(const Mat3<double>& m) {
  Eigen::Matrix3d result;
  for (int c = 0; c < 3; ++c) result.col(c) << m.column[c].x, m.column[c].y, m.column[c].z;
  return result;
}

}  // namespace

Eigen::Matrix3d rotated_vector_derivative(const Eigen::Vector3d& omega, const Eigen::Vector3d& v) {
  return matrix(Rotation<double>(vec(omega)).derivative(vec(v)));
}

std::array<Eigen::Matrix3d, 3> rotated_vector_second_derivative(const Eigen::Vector3d& omega,
                                                                const Eigen::Vector3d& v) {
  const Rotation<double> rotation(vec(omega));
  std::array<Eigen::Matrix3d, 3> result;
  for (int c = 0; c < 3; ++c)
    result[c] = matrix(full(rotation.second_derivative(vec(v), vec(Eigen::Vector3d::Unit(c)))));
  return result;
}

}  // namespace limber::rotations
