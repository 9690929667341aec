#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "engine/base/random.h"
#include "engine/reduced/rs_coordinates.h"

namespace limber::reduced::testing {

/// Standard normal entries.
inline Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, Random& random) {
  Eigen::MatrixXd result(rows, columns);
  for (double& entry : result.reshaped()) entry = random.normal();
  return result;
}
inline Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed);
  return random_matrix(rows, columns, random);
}

/// Coordinates of about `size`, a column per frame.
inline Eigen::MatrixXd random_motion(Eigen::Index coordinates, int frames, double size,
                                     std::uint64_t seed) {
  return size * random_matrix(coordinates, frames, seed);
}

/// RS coordinates of a tet that turns by `angle` [rad].
inline RsVector random_coordinates(double angle, double strain, Random& random) {
  RsVector y;
  for (int i = 0; i < 9; ++i) y[i] = random.normal();
  y.head<3>() *= angle / y.head<3>().norm();
  y.tail<6>() *= strain;
  return y;
}

}  // namespace limber::reduced::testing
