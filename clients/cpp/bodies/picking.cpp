#include "clients/cpp/bodies/picking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "clients/cpp/error.h"

namespace limber::client {
namespace {

using Corners = std::array<Vector, 3>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector mean(const Corners& corners, const Vector& weights) {
  Vector sum{};
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (std::size_t axis = 0; axis < 3; ++axis)
      sum[axis] += weights[corner] * corners[corner][axis];
  return sum;
}

double distance(const Vector& a, const Vector& b) {
  const Vector apart = minus(a, b);
  return std::sqrt(dot(apart, apart));
}

/// Weights of the point of the three edges that is nearest to x.
Vector nearest_on_edges(const Corners& corners, const Vector& x) {
  Vector best{};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector edge = minus(corners[(k + 1) % 3], corners[k]);
    const double length = dot(edge, edge);
    double share = length > 0 ? dot(minus(x, corners[k]), edge) / length : 0;
    share = std::clamp(share, 0.0, 1.0);
    Vector weights{};
    weights[k] = 1 - share;
    weights[(k + 1) % 3] = share;
    const double apart = distance(mean(corners, weights), x);
    if (apart >= least) continue;
    least = apart;
    best = weights;
  }
  return best;
}

/// Weights of the point of the triangle that is nearest to x.
Vector nearest_weights(const Corners& corners, const Vector& x) {
  constexpr double kFlat = 1e-14;  // of the squares of sides: a triangle without area
  const Vector u = minus(corners[1], corners[0]), v = minus(corners[2], corners[0]),
               w = minus(x, corners[0]);
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
  const double area = uu * vv - uv * uv;
  if (!(area > kFlat * uu * vv)) return nearest_on_edges(corners, x);
  const double b = (vv * dot(u, w) - uv * dot(v, w)) / area;
  const double c = (uu * dot(v, w) - uv * dot(u, w)) / area;
  if (b < 0 || c < 0 || b + c > 1) return nearest_on_edges(corners, x);
  return {1 - b - c, b, c};
}

Vector vertex_of(const std::vector<double>& points, std::size_t index) {
  return {points.at(3 * index), points.at(3 * index + 1), points.at(3 * index + 2)};
}

}  // namespace

PickedPoint nearest_point(const DrawnSurface& surface, const Vector& position) {
  if (surface.triangles.empty()) {
    throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "surface",
                      "a surface without triangles has no points");
  }
  PickedPoint picked;
  picked.distance = std::numeric_limits<double>::infinity();
  Vector weights{};
  for (std::size_t t = 0; t < surface.triangles.size() / 3; ++t) {
    Corners corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] =
          vertex_of(surface.vertices, static_cast<std::size_t>(surface.triangles[3 * t + k]));
    }
    const Vector here = nearest_weights(corners, position);
    const Vector point = mean(corners, here);
    const double apart = distance(point, position);
    if (apart >= picked.distance) continue;
    picked.distance = apart;
    picked.position = point;
    picked.point.set_triangle(static_cast<std::uint32_t>(t));
    weights = here;
  }
  for (const double weight : weights) picked.point.add_weights(weight);
  picked.point.set_surface(surface.surface);
  return picked;
}

std::vector<std::uint32_t> points_in_box(const std::vector<double>& points, const Vector& low,
                                         const Vector& high) {
  std::vector<std::uint32_t> inside;
  for (std::size_t i = 0; i < points.size() / 3; ++i) {
    const Vector at = vertex_of(points, i);
    bool is_inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      is_inside = is_inside && at[axis] >= low[axis] && at[axis] <= high[axis];
    if (is_inside) inside.push_back(static_cast<std::uint32_t>(i));
  }
  return inside;
}

}  // namespace limber::client
