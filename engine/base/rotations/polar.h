#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace limber::rotations {

/// F = R S with R a proper rotation (det +1 even where F is inverted) and S symmetric, indefinite
/// if F is inverted.
struct Polar {
  Eigen::Quaterniond rotation;
  Eigen::Matrix3d stretch;
};

/// The rotation nearest to F in the Frobenius norm, also for singular and inverted F. R is then not
/// unique only if the two smallest signed singular values cancel; some nearest rotation is
/// returned, the identity for F = 0. Found as the dominant eigenvector of Horn's 4 x 4 matrix,
/// which needs no case distinctions.
/// @pre F is finite
[[nodiscard]] Polar polar_decomposition(const Eigen::Matrix3d& f);

}  // namespace limber::rotations
