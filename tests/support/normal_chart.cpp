#include "tests/support/normal_chart.h"

#include <Eigen/Geometry>
#include <cmath>

namespace limber::beams {

using Eigen::Vector3d;

ChartedNormal normal_of_chart(double n_x, double n_y, double rim) {
  const double square = n_x * n_x + n_y * n_y;
  const double rho = std::sqrt(square), cubed = rho * square;
  ChartedNormal result;
  result.derivative.setZero();
  result.normal =
      square <= 1 ? Vector3d(n_x, n_y, std::sqrt(1 - square)) : Vector3d(n_x / rho, n_y / rho, 0);
  if (square <= 1 - rim) {
    result.derivative(0, 0) = result.derivative(1, 1) = 1;
    result.derivative(2, 0) = -n_x / result.normal.z();
    result.derivative(2, 1) = -n_y / result.normal.z();
    return result;
  }
  result.derivative(0, 0) = n_y * n_y / cubed;
  result.derivative(1, 1) = n_x * n_x / cubed;
  result.derivative(0, 1) = result.derivative(1, 0) = -n_x * n_y / cubed;
  return result;
}

Eigen::Vector2d charted_moment(const Eigen::Vector3d& moment, double n_x, double n_y, double rim) {
  const ChartedNormal n = normal_of_chart(n_x, n_y, rim);
  const Vector3d slope_x = n.derivative.col(0), slope_y = n.derivative.col(1);
  return {moment.dot(n.normal.cross(slope_x)), moment.dot(n.normal.cross(slope_y))};
}

}  // namespace limber::beams
