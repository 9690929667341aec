#pragma once

#include <Eigen/Core>

namespace limber::rotations {

/// theta^x, the matrix of v -> theta x v.
[[nodiscard]] Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& theta);

/// exp(theta^x), the rotation by |theta| [rad] about theta (Rodrigues). Any finite angle.
[[nodiscard]] Eigen::Matrix3d exponential(const Eigen::Vector3d& theta);

/// exp(theta^x) - I with relative accuracy for small angles.
[[nodiscard]] Eigen::Matrix3d exponential_minus_identity(const Eigen::Vector3d& theta);

/// Column k is d exp(theta^x) / d theta_k, column-major 3 x 3.
[[nodiscard]] Eigen::Matrix<double, 9, 3> exponential_derivative(const Eigen::Vector3d& theta);

/// d/dt exp((theta + t direction)^x) at t = 0.
[[nodiscard]] Eigen::Matrix3d exponential_derivative(const Eigen::Vector3d& theta,
                                                     const Eigen::Vector3d& direction);

/// Many maps at once, structure of arrays: component c of item i at theta[c * theta_stride + i],
/// entry e (column-major) of its rotation at rotation[e * rotation_stride + i]. No alignment is
/// asked for. T: float or double.
template <class T>
void exponential_batch(int count, const T* theta, std::ptrdiff_t theta_stride, T* rotation,
                       std::ptrdiff_t rotation_stride);

}  // namespace limber::rotations
