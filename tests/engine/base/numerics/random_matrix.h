#pragma once

#include <Eigen/Dense>
#include <cstdint>

#include "engine/base/random.h"

namespace limber::testing {

/// Standard normal entries.
inline Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd result(rows, columns);
  for (double& entry : result.reshaped()) entry = random.normal();
  return result;
}

}  // namespace limber::testing
