#include "engine/beams/element/normal_chart.h"

#include <Eigen/Geometry>
#include <cmath>

namespace limber::beams {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The element frame of (3) to (6) and the angles of (17), (24).
struct Charted {
  ChartedNormal a, b;
  double length;
  Vector3d t1, t2;
  double side;  // |n_k x t_1|
  double sum;   // |n_a + n_b|
  double twist, angle_a, angle_b;

  explicit Charted(const ChartedVector& u)
      : a(normal_of_chart(u[3], u[4])), b(normal_of_chart(u[8], u[9])) {
    const Vector3d v = u.segment<3>(5) - u.segment<3>(0);
    const Vector3d both = a.normal + b.normal;
    length = v.norm();
    t1 = v / length;
    sum = both.norm();
    const Vector3d across = (both / sum).cross(t1);
    side = across.norm();
    t2 = across / side;
    twist = t2.dot(a.normal - b.normal);
    angle_a = t1.dot(a.normal);
    angle_b = t1.dot(b.normal);
  }
};

}  // namespace

ChartedNormal normal_of_chart(double n_x, double n_y) {
  const double square = n_x * n_x + n_y * n_y;
  ChartedNormal result;
  result.derivative.setZero();
  if (square <= 1) {
    const double n_z = std::sqrt(1 - square);
    result.normal = Vector3d(n_x, n_y, n_z);
    result.derivative(0, 0) = result.derivative(1, 1) = 1;
    result.derivative(2, 0) = -n_x / n_z;
    result.derivative(2, 1) = -n_y / n_z;
    return result;
  }
  const double rho = std::sqrt(square), cubed = rho * square;
  result.normal = Vector3d(n_x / rho, n_y / rho, 0);
  result.derivative(0, 0) = n_y * n_y / cubed;
  result.derivative(1, 1) = n_x * n_x / cubed;
  result.derivative(0, 1) = result.derivative(1, 0) = -n_x * n_y / cubed;
  return result;
}

Eigen::Vector2d charted_moment(const Eigen::Vector3d& moment, double n_x, double n_y) {
  const ChartedNormal n = normal_of_chart(n_x, n_y);
  const Vector3d slope_x = n.derivative.col(0), slope_y = n.derivative.col(1);
  return {moment.dot(n.normal.cross(slope_x)), moment.dot(n.normal.cross(slope_y))};
}

double charted_energy(const ChartedElement& e, const ChartedVector& unknowns) {
  const Charted q(unknowns);
  const double stretch = q.length - e.length;
  return (0.5 * e.stretching * stretch * stretch + 0.5 * e.torsion * q.twist * q.twist +
          2 * e.bending_2 *
              (q.angle_a * q.angle_a + q.angle_a * q.angle_b + q.angle_b * q.angle_b)) /
         e.length;
}

ChartedVector charted_gradient(const ChartedElement& e, const ChartedVector& unknowns) {
  const Charted q(unknowns);
  const double by_a = 2 * e.bending_2 * (2 * q.angle_a + q.angle_b) / e.length;
  const double by_b = 2 * e.bending_2 * (2 * q.angle_b + q.angle_a) / e.length;
  const double by_twist = e.torsion * q.twist / e.length;
  // Twist by t_2, and that by what it is made of: n_k x t_1, normalised twice.
  const Vector3d by_t2 = by_twist * (q.a.normal - q.b.normal);
  const Vector3d by_across = (by_t2 - by_t2.dot(q.t2) * q.t2) / q.side;
  const Vector3d n_k = (q.a.normal + q.b.normal) / q.sum;
  const Vector3d by_n_k = q.t1.cross(by_across);
  const Vector3d by_sum = (by_n_k - by_n_k.dot(n_k) * n_k) / q.sum;
  const Vector3d by_t1 = by_a * q.a.normal + by_b * q.b.normal + by_across.cross(n_k);
  const Vector3d by_v = (by_t1 - by_t1.dot(q.t1) * q.t1) / q.length +
                        e.stretching * (q.length - e.length) / e.length * q.t1;
  const Vector3d by_n_a = by_a * q.t1 + by_twist * q.t2 + by_sum;
  const Vector3d by_n_b = by_b * q.t1 - by_twist * q.t2 + by_sum;
  ChartedVector gradient;
  gradient.segment<3>(0) = -by_v;
  gradient.segment<2>(3) = q.a.derivative.transpose() * by_n_a;
  gradient.segment<3>(5) = by_v;
  gradient.segment<2>(8) = q.b.derivative.transpose() * by_n_b;
  return gradient;
}

}  // namespace limber::beams
