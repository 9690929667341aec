#pragma once

#include <Eigen/Core>
#include <vector>

/// Signed distances (negative inside) of simple bodies and methods to join them, after I. Quilez,
/// "Distance functions".
namespace limber::scene::samples {

using Eigen::Vector3d;

/// The hull of two balls. Exact.
[[nodiscard]] double round_cone(const Vector3d& x, const Vector3d& a, double radius_a,
                                const Vector3d& b, double radius_b);

/// An ellipsoid along the axes; a bound of the distance that is exact at the surface.
[[nodiscard]] double ellipsoid(const Vector3d& x, const Vector3d& centre, const Vector3d& radii);

/// The smaller of two distances with the crease between them filled over a width of about `width`.
[[nodiscard]] double blend(double a, double b, double width);

/// A ball swept along a polyline with a radius per point; neighbouring pieces share their ball, so
/// there is no crease.
struct Tube {
  std::vector<Vector3d> points;
  std::vector<double> radii;
  [[nodiscard]] double distance(const Vector3d& x) const;
};
/// Points and radii interpolated by Catmull-Rom between a few given ones, `pieces` per interval.
[[nodiscard]] Tube smooth_tube(const std::vector<Vector3d>& points,
                               const std::vector<double>& radii, int pieces);

/// A blade such as a petal or a wing: the hull of two circles in a plane, given thickness with a
/// round rim, and rolled up along its length.
struct Blade {
  Vector3d root;      // centre of the first circle
  Vector3d along;     // unit: from the root to the tip, at the root
  Vector3d up;        // unit, across `along`: the side towards which a positive curl bends it
  double length = 1;  // between the circles' centres, along the blade
  double root_radius = 0.1, tip_radius = 0.1;
  double half_thickness = 0.02;
  double curl = 0;  // total angle by which the blade is bent over its length [rad]
  double cup = 0;   // curvature across the blade [1/m]

  [[nodiscard]] double distance(const Vector3d& x) const;
};

}  // namespace limber::scene::samples
