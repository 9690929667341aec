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
/// @param rim  the derivative is taken as outside the disc from n_x^2 + n_y^2 = 1 - rim on, which
///   bounds it by 1 / sqrt(rim) (the public code has 1e-5); 0: as in the paper
[[nodiscard]] ChartedNormal normal_of_chart(double n_x, double n_y, double rim = 0);

/// Forces on n_x and n_y that do the work of a moment on the node [force length].
[[nodiscard]] Eigen::Vector2d charted_moment(const Eigen::Vector3d& moment, double n_x, double n_y,
                                             double rim = 0);

}  // namespace limber::beams
