#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// 3 x joints [length].
[[nodiscard]] inline Eigen::Matrix3Xd joint_positions(const LinkageState& state) {
  Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(state.joints().size()));
  for (Eigen::Index j = 0; j < positions.cols(); ++j)
    positions.col(j) = state.joints()[static_cast<std::size_t>(j)].position;
  return positions;
}

}  // namespace limber::rods
