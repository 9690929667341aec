#pragma once

#include <Eigen/Core>

namespace limber::beams {

/// The paper's unknowns for a normal, to compare with: two components n_x and n_y. Inside the unit
/// disc the third makes up the length; outside, the normal lies on the equator (bending-active,
/// eq. 12 and 13 with the errata).
struct ChartedNormal {
  Eigen::Vector3d normal;
  Eigen::Matrix<double, 3, 2> derivative;  // by n_x and n_y; without bound at the rim
};
[[nodiscard]] ChartedNormal normal_of_chart(double n_x, double n_y);

/// Forces on n_x and n_y that do the work of a moment on the node [force length].
[[nodiscard]] Eigen::Vector2d charted_moment(const Eigen::Vector3d& moment, double n_x, double n_y);

/// An element by the paper's unknowns, without its second bending force: stretching, twisting and
/// bending about axis 2 (bending-active, sec. 2.1 to 2.3).
struct ChartedElement {
  double length = 1;      // at rest
  double stretching = 0;  // EA
  double torsion = 0;     // GJ
  double bending_2 = 0;   // EI_2
};

/// Unknowns: position of the start, n_x and n_y of the start, then the same of the finish.
using ChartedVector = Eigen::Matrix<double, 10, 1>;
[[nodiscard]] double charted_energy(const ChartedElement& element, const ChartedVector& unknowns);
[[nodiscard]] ChartedVector charted_gradient(const ChartedElement& element,
                                             const ChartedVector& unknowns);

}  // namespace limber::beams
