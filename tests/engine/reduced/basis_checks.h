#pragma once

#include <Eigen/Core>

namespace limber::reduced::testing {

/// Largest part of a column of u, relative, that b does not span.
inline double left_over(const Eigen::MatrixXd& b, const Eigen::MatrixXd& u) {
  const Eigen::MatrixXd rest = u - b * (b.transpose() * u);
  return (rest.colwise().norm().array() / u.colwise().norm().array()).maxCoeff();
}

}  // namespace limber::reduced::testing
