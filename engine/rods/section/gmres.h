#pragma once

#include <Eigen/Core>
#include <functional>

namespace limber::rods {

/// A x = b by GMRES without restarts, for operators that are a small part away from a multiple of
/// the identity. Stops at |b - A x| <= tolerance |b|, or where that no longer improves.
[[nodiscard]] Eigen::VectorXd gmres(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& apply, const Eigen::VectorXd& b,
    double tolerance);

}  // namespace limber::rods
