#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/beams/element/element_energy.h"

namespace limber::beams {

/// For a force that an element does not pass on at one end: the end that carries the load along its
/// axis.
enum class Carrier { kBoth, kStart, kFinish };

/// How a load over an element reaches its ends.
struct LoadTransfer {
  /// Length of the end tangents of the cubic that is loaded: the length at rest; 0: straight.
  double lever = 0;
  /// By axis of the section: axial force, shear along 2, along 3.
  std::array<Carrier, 3> carriers{Carrier::kBoth, Carrier::kBoth, Carrier::kBoth};
};

/// A load that is spread over an element: the force on its whole length [force] if the load per
/// length were everywhere that of its start, or of its finish. In space; linear in between.
struct SpreadLoad {
  Eigen::Vector3d start = Eigen::Vector3d::Zero(), finish = Eigen::Vector3d::Zero();

  [[nodiscard]] bool is_zero() const { return start.isZero(0) && finish.isZero(0); }
  [[nodiscard]] Eigen::Vector3d resultant() const { return 0.5 * (start + finish); }
};

/// Forces and moments on the ends, in the order of element_gradient. They do the same work as the
/// load on the cubic x(s) = h_1 p_a + h_2 p_b + lever (h_3 x_a + h_4 x_b). Its end tangents x_a,
/// x_b are axes 1 of the ends. At small rotations they are minus the fixed-end forces. See
/// NOTATION.md, "Loads over elements".
[[nodiscard]] ElementVector spread_forces(const LoadTransfer& transfer, const ElementEnds& ends,
                                          const SpreadLoad& load);

/// Potential of a load of constant direction [force length]; spread_forces are minus its gradient.
/// @param resultant  in space [force]
[[nodiscard]] double spread_potential(const LoadTransfer& transfer, const ElementEnds& ends,
                                      const Eigen::Vector3d& resultant);

/// Its second derivatives, symmetric: along exp(omega^x), as element_hessian.
[[nodiscard]] ElementMatrix spread_hessian(const LoadTransfer& transfer, const ElementEnds& ends,
                                           const Eigen::Vector3d& resultant);

/// Derivative of spread_forces where the load turns with the ends: its value at an end has the spin
/// of that end.
[[nodiscard]] ElementMatrix following_derivative(const LoadTransfer& transfer,
                                                 const ElementEnds& ends, const SpreadLoad& load);

}  // namespace limber::beams
