#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

namespace limber::rods {

/// Axes of points' scatter about their mean, orthonormal columns: first the normal of the plane
/// nearest to them, last the direction in which they extend farthest.
[[nodiscard]] inline Eigen::Matrix3d principal_axes(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd offsets = points.colwise() - points.rowwise().mean();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(offsets * offsets.transpose())
      .eigenvectors();
}

}  // namespace limber::rods
