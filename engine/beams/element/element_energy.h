#pragma once

#include <Eigen/Core>

#include "engine/beams/element/element_kernel.h"

namespace limber::beams {

using ElementVector = Eigen::Matrix<double, 12, 1>;
using ElementMatrix = Eigen::Matrix<double, 12, 12>;

/// The ends of one element: positions, and the axes of their sections as columns.
struct ElementEnds {
  Eigen::Vector3d start, finish;
  Eigen::Matrix3d start_axes, finish_axes;
};

/// Elastic energy of an element [force length], by mode.
[[nodiscard]] ElementEnergies<double> element_energies(const ElementConstants<double>& constants,
                                                       const ElementEnds& ends);

/// By how much the finish has turned about the chord against the start, in (-pi, pi] [rad].
[[nodiscard]] double twist_angle(const ElementConstants<double>& constants,
                                 const ElementEnds& ends);

/// Gradient by translation and spin of the start, then of the finish: a spin omega [rad] takes the
/// axes to exp(omega^x) axes.
[[nodiscard]] ElementVector element_gradient(const ElementConstants<double>& constants,
                                             const ElementEnds& ends);

/// Which forces of an element count in second derivatives. Compression pushes sideways and makes
/// them less than positive: where only a guess has shortened the element, it is better left out.
enum class Compression {
  kCounts,
  kLeftOut,
  kWithAllForcesLeftOut,  // resistance of the material: semi-definite
};

/// Share of a cable's stiffness EA / L in second derivatives: all of it if it is pulled, nothing if
/// it is slack. A cable that is just taut, at its rest length within rounding, has one value to
/// each side. The mean of both stands for them; whether it is enough is another question
/// (detail::just_taut_cables).
enum class CableTension { kSlack, kJustTaut, kPulled };
[[nodiscard]] CableTension cable_tension(const ElementConstants<double>& constants,
                                         const ElementEnds& ends);

/// Second derivatives by the same twelve, symmetric: along exp(omega^x) from where the ends are.
///
///            p_a   omega_a  p_b   omega_b
///     p_a  [  D     -G_a    -D     -G_b  ]
///  omega_a [         A       G_a^T  C    ]
///     p_b  [                 D      G_b  ]
///  omega_b [                        B    ]
[[nodiscard]] ElementMatrix element_hessian(const ElementConstants<double>& constants,
                                            const ElementEnds& ends,
                                            Compression compression = Compression::kCounts);

/// The axes as the kernel takes them.
[[nodiscard]] Triad<double> triad(const Eigen::Matrix3d& axes);
[[nodiscard]] inline Vec3<double> vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
[[nodiscard]] inline Eigen::Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

}  // namespace limber::beams
