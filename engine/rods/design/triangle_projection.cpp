#include "engine/rods/design/triangle_projection.h"

#include <Eigen/Geometry>

namespace limber::rods {
namespace {

ClosestPoint on_edge(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double share) {
  const Eigen::Vector3d along = to - from;
  return {from + share * along, along * along.transpose() / along.squaredNorm()};
}

}  // namespace

ClosestPoint project_onto_triangle(const Eigen::Matrix3d& corners, const Eigen::Vector3d& point) {
  const Eigen::Vector3d a = corners.col(0), b = corners.col(1), c = corners.col(2);
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const Eigen::Vector3d ap = point - a, bp = point - b, cp = point - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, Eigen::Matrix3d::Zero()};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, Eigen::Matrix3d::Zero()};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, Eigen::Matrix3d::Zero()};
  if (d1 * d4 - d3 * d2 <= 0 && d1 >= 0 && d3 <= 0) return on_edge(a, b, d1 / (d1 - d3));
  if (d5 * d2 - d1 * d6 <= 0 && d2 >= 0 && d6 <= 0) return on_edge(a, c, d2 / (d2 - d6));
  const double along = d4 - d3, back = d5 - d6;
  if (d3 * d6 - d5 * d4 <= 0 && along >= 0 && back >= 0)
    return on_edge(b, c, along / (along + back));
  const Eigen::Vector3d normal = ab.cross(ac).normalized();
  return {point - normal.dot(ap) * normal,
          Eigen::Matrix3d::Identity() - normal * normal.transpose()};
}

}  // namespace limber::rods
