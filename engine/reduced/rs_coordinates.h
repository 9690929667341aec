#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/bodies/gradient_operator.h"

namespace limber::reduced {

/// Numbers per tet in y and in g.
inline constexpr int kRsSize = 9;

/// RS coordinates of one tet (paper: space-time editing, section 2.2):
/// - 0..2: theta [rad]; (theta x v) is the antisymmetric part of the displacement gradient applied
///   to v
/// - 3..8: strain, the symmetric part: xx, yy, zz, yz, xz, xy
using RsVector = Eigen::Matrix<double, kRsSize, 1>;

/// y = Q u of one tet: the parts of its displacement gradient H.
[[nodiscard]] RsVector rs_of_gradient(const Eigen::Matrix3d& gradient);
/// The gradient whose parts are y: inverse of rs_of_gradient, and the derivative of g at y = 0.
[[nodiscard]] Eigen::Matrix3d linear_gradient(const RsVector& y);
/// g(y) = exp(theta^x) (I + strain) - I (eq. 5), accurate also for tiny y.
[[nodiscard]] Eigen::Matrix3d displacement_gradient(const RsVector& y);
/// dg/dy: column c is the column-major derivative of g by y_c.
[[nodiscard]] Eigen::Matrix<double, 9, 9> displacement_gradient_derivative(const RsVector& y);

/// Q u for the columns of u (3n x k): 9m x k, rows 9 tet + component.
[[nodiscard]] Eigen::MatrixXd linear_coordinates(const bodies::GradientOperator& gradient,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& u);
/// The same for some tets only, in their order: 9 tets.size() x k.
[[nodiscard]] Eigen::MatrixXd linear_coordinates(const bodies::GradientOperator& gradient,
                                                 const std::vector<int>& tets,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& u);

}  // namespace limber::reduced
