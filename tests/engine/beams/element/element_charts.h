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

/// Ends as a function of positions and rotation vectors from where they are.
inline ElementEnds ends_at(const ElementEnds& from, const Eigen::VectorXd& x) {
  ElementEnds at = from;
  at.start = x.segment<3>(0);
  at.finish = x.segment<3>(6);
  at.start_axes = rotations::exponential(x.segment<3>(3)) * from.start_axes;
  at.finish_axes = rotations::exponential(x.segment<3>(9)) * from.finish_axes;
  return at;
}

/// A function of the ends of an element by their positions and rotation vectors from where they
/// are: exact gradients anywhere, the Hessian where the rotation vectors are zero.
/// @param value, gradient, hessian  of ElementEnds; the latter two by translations and spins
template <class Value, class Gradient, class Hessian>
limber::testing::EnergyUnderTest energy_of_ends(const ElementEnds& from, Value value,
                                                Gradient gradient, Hessian hessian) {
  limber::testing::EnergyUnderTest energy;
  energy.value = [from, value](const Eigen::VectorXd& x) { return value(ends_at(from, x)); };
  energy.gradient = [from, gradient](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    ElementVector g = gradient(ends_at(from, x));
    g.segment<3>(3) = (spins(x.segment<3>(3)).transpose() * g.segment<3>(3)).eval();
    g.segment<3>(9) = (spins(x.segment<3>(9)).transpose() * g.segment<3>(9)).eval();
    return g;
  };
  energy.hessian = [from, hessian](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
    return hessian(ends_at(from, x));
  };
  return energy;
}

/// The elastic energy of an element.
inline limber::testing::EnergyUnderTest element_energy(const ElementConstants<double>& constants,
                                                       const ElementEnds& from) {
  return energy_of_ends(
      from,
      [constants](const ElementEnds& ends) { return element_energies(constants, ends).total(); },
      [constants](const ElementEnds& ends) { return element_gradient(constants, ends); },
      [constants](const ElementEnds& ends) { return element_hessian(constants, ends); });
}

}  // namespace limber::beams::testing
