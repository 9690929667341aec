#pragma once

#include <Eigen/Core>

#include "engine/base/random.h"
#include "engine/spacetime/recovery.h"

namespace limber::testing {

/// Free motion of given dynamics, r x frames; modes begin apart from each other.
inline Eigen::MatrixXd free_motion(const spacetime::ModeDynamics& dynamics, int frames) {
  spacetime::RecoveredMotion begun{Eigen::MatrixXd(dynamics.stiffness.size(), 2), {}, dynamics};
  for (Eigen::Index k = 0; k < begun.z.rows(); ++k) {
    begun.z(k, 0) = 1 + 0.3 * static_cast<double>(k);
    begun.z(k, 1) = 0.8 - 0.4 * static_cast<double>(k);
  }
  Eigen::MatrixXd z(begun.z.rows(), frames);
  z << begun.z, spacetime::continue_freely(begun, frames - 2).z;
  return z;
}

inline Eigen::MatrixXd random_matrix(int rows, int columns, double size, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd result(rows, columns);
  for (Eigen::Index i = 0; i < result.size(); ++i) result.data()[i] = size * random.normal();
  return result;
}

/// S with columns of length one.
inline Eigen::MatrixXd unit_columns(int rows, int columns, std::uint64_t seed) {
  return random_matrix(rows, columns, 1, seed).colwise().normalized();
}

inline spacetime::ModeDynamics three_modes() {
  return {Eigen::Vector3d(0.04, 0.3, 0.9), Eigen::Vector3d(0.004, 0.02, 0.1)};
}

/// Eigenvalues 1, 4, 9, ...
inline Eigen::VectorXd eigenvalues(int count) {
  return Eigen::VectorXd::LinSpaced(count, 1, count).array().square();
}

}  // namespace limber::testing
