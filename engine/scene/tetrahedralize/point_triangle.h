#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace limber::scene::lattice {

/// Squared distance of x to the triangle abc (C. Ericson, Real-Time Collision Detection, 5.1.5).
[[nodiscard]] inline double squared_distance(const Eigen::Vector3d& x, const Eigen::Vector3d& a,
                                             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ax = x - a;
  const double d1 = ab.dot(ax), d2 = ac.dot(ax);
  if (d1 <= 0 && d2 <= 0) return ax.squaredNorm();
  const Eigen::Vector3d bx = x - b;
  const double d3 = ab.dot(bx), d4 = ac.dot(bx);
  if (d3 >= 0 && d4 <= d3) return bx.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 != d3) return (ax - d1 / (d1 - d3) * ab).squaredNorm();
  const Eigen::Vector3d cx = x - c;
  const double d5 = ab.dot(cx), d6 = ac.dot(cx);
  if (d6 >= 0 && d5 <= d6) return cx.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 != d6) return (ax - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  const double along = (d4 - d3) + (d5 - d6);
  if (va <= 0 && d4 >= d3 && d5 >= d6 && along > 0)
    return (bx - (d4 - d3) / along * (c - b)).squaredNorm();
  const double sum = va + vb + vc;
  if (!(sum > 0))
    return std::min({ax.squaredNorm(), bx.squaredNorm(), cx.squaredNorm()});  // a needle or a point
  return (ax - vb / sum * ab - vc / sum * ac).squaredNorm();
}

}  // namespace limber::scene::lattice
