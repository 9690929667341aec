#pragma once

#include <Eigen/Geometry>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/beams/element/element_energy.h"
#include "tests/support/energy_conformance.h"

namespace limber::beams::testing {

/// Spin exp((x + t direction)^x) at t = 0: the left Jacobian of the rotation vector, by columns.
inline Eigen::Matrix3d spins(const Eigen::Vector3d& x) {
  Eigen::Matrix3d result;
  const Eigen::Matrix3d inverse = rotations::exponential(x).transpose();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3d w =
        rotations::exponential_derivative(x, Eigen::Vector3d::Unit(k)) * inverse;
    result.col(k) = Eigen::Vector3d(w(2, 1), w(0, 2), w(1, 0));
  }
  return result;
}

/// An element as a function of positions and rotation vectors from where the ends are: exact
/// gradients anywhere, the Hessian where the rotation vectors are zero.
inline limber::testing::EnergyUnderTest element_energy(const ElementConstants<double>& constants,
                                                       const ElementEnds& from) {
  const auto ends = [from](const Eigen::VectorXd& x) {
    ElementEnds at = from;
    at.start = x.segment<3>(0);
    at.finish = x.segment<3>(6);
    at.start_axes = rotations::exponential(x.segment<3>(3)) * from.start_axes;
    at.finish_axes = rotations::exponential(x.segment<3>(9)) * from.finish_axes;
    return at;
  };
  limber::testing::EnergyUnderTest energy;
  energy.value = [constants, ends](const Eigen::VectorXd& x) {
    return element_energies(constants, ends(x)).total();
  };
  energy.gradient = [constants, ends](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    ElementVector g = element_gradient(constants, ends(x));
    g.segment<3>(3) = (spins(x.segment<3>(3)).transpose() * g.segment<3>(3)).eval();
    g.segment<3>(9) = (spins(x.segment<3>(9)).transpose() * g.segment<3>(9)).eval();
    return g;
  };
  energy.hessian = [constants, ends](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
    return element_hessian(constants, ends(x));
  };
  return energy;
}

}  // namespace limber::beams::testing
