#include "engine/scene/samples/shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace limber::scene::samples {
namespace {

/// std::hypot guards against overflow that cannot occur here, at five times the price.
double norm2(double x, double y) { return std::sqrt(x * x + y * y); }

/// Hull of a circle of radius r1 at the origin and one of radius r2 at (length, 0): distance in the
/// plane; exact.
double uneven_capsule(double x, double y, double r1, double r2, double length) {
  y = std::abs(y);
  const double b = (r1 - r2) / length;
  const double a = std::sqrt(std::max(0.0, 1 - b * b));
  const double k = -b * y + a * x;  // along the slanted side
  if (k < 0) return norm2(x, y) - r1;
  if (k > a * length) return norm2(x - length, y) - r2;
  return a * y + b * x - r1;
}

}  // namespace

double round_cone(const Vector3d& x, const Vector3d& a, double radius_a, const Vector3d& b,
                  double radius_b) {
  const double length = (b - a).norm();
  if (length <= std::abs(radius_a - radius_b)) {
    return std::min((x - a).norm() - radius_a, (x - b).norm() - radius_b);
  }
  const Vector3d axis = (b - a) / length;
  const double along = (x - a).dot(axis);
  return uneven_capsule(along, (x - a - along * axis).norm(), radius_a, radius_b, length);
}

double ellipsoid(const Vector3d& x, const Vector3d& centre, const Vector3d& radii) {
  const Vector3d scaled = (x - centre).cwiseQuotient(radii);
  const double k0 = scaled.norm();
  const double k1 = scaled.cwiseQuotient(radii).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
}

double blend(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * width / 4;
}

double Tube::distance(const Vector3d& x) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < points.size(); ++i) {
    nearest = std::min(nearest, round_cone(x, points[i - 1], radii[i - 1], points[i], radii[i]));
  }
  return nearest;
}

Tube smooth_tube(const std::vector<Vector3d>& points, const std::vector<double>& radii,
                 int pieces) {
  Tube tube;
  const auto clamped = [&](std::ptrdiff_t i) {
    return static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(points.size()) - 1));
  };
  const auto spline = [](const auto& p0, const auto& p1, const auto& p2, const auto& p3, double t) {
    return (0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * (t * t) +
                   (3 * p1 - p0 - 3 * p2 + p3) * (t * t * t)));
  };
  for (std::ptrdiff_t i = 0; i + 1 < static_cast<std::ptrdiff_t>(points.size()); ++i) {
    const std::size_t a = clamped(i - 1), b = clamped(i), c = clamped(i + 1), d = clamped(i + 2);
    for (int piece = 0; piece < pieces; ++piece) {
      const double t = static_cast<double>(piece) / pieces;
      tube.points.emplace_back(spline(points[a], points[b], points[c], points[d], t));
      tube.radii.push_back(spline(radii[a], radii[b], radii[c], radii[d], t));
    }
  }
  tube.points.push_back(points.back());
  tube.radii.push_back(radii.back());
  return tube;
}

double Blade::distance(const Vector3d& x) const {
  const Vector3d side = up.cross(along);
  const Vector3d local = x - root;
  double s = local.dot(along);
  double n = local.dot(up);
  const double t = local.dot(side);
  if (std::abs(curl) > 1e-9) {
    // The middle line is an arc of radius length / curl around a centre on the `up` side: unroll
    // it. Past its ends it continues straight, so that the rim is round there too.
    const double radius = length / std::abs(curl);
    const double sign = curl > 0 ? 1 : -1;
    const double total = std::abs(curl);
    const double to_centre = radius - sign * n;
    const double angle = std::atan2(s, to_centre);
    if (angle > 0 && angle <= total) {
      n = sign * (radius - norm2(s, to_centre));
      s = radius * angle;
    } else if (angle > total || angle < -std::max(0.5, (2 * std::numbers::pi - total) / 2)) {
      const double dx = s - radius * std::sin(total);
      const double dn = sign * n - radius * (1 - std::cos(total));
      s = length + dx * std::cos(total) + dn * std::sin(total);
      n = sign * (-dx * std::sin(total) + dn * std::cos(total));
    }
  }
  n -= cup * t * t / 2;
  const double rim = half_thickness;  // fully rounded
  const double outline = uneven_capsule(s, t, root_radius, tip_radius, length) + rim;
  return norm2(std::max(outline, 0.0), n) - rim;
}

}  // namespace limber::scene::samples
