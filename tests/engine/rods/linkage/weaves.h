#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/rods/linkage/line_mesh.h"

namespace limber::rods::testing {

inline LineMesh lines_of(const std::vector<Eigen::Vector3d>& points,
                         const std::vector<std::pair<int, int>>& lines) {
  LineMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  mesh.edges.resize(2, static_cast<Eigen::Index>(lines.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = points[i];
  for (std::size_t i = 0; i < lines.size(); ++i)
    mesh.edges.col(static_cast<Eigen::Index>(i)) << lines[i].first, lines[i].second;
  return mesh;
}

/// Great circles of a unit ball, each across one of the axes, drawn from crossing to crossing; no
/// three of them cross at a point.
inline LineMesh great_circles(const std::vector<Eigen::Vector3d>& axes) {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<int>> on(axes.size());
  for (std::size_t i = 0; i < axes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (const int side : {1, -1}) {
        for (const std::size_t circle : {i, j})
          on[circle].push_back(static_cast<int>(points.size()));
        points.emplace_back(side * axes[i].cross(axes[j]).normalized());
      }
    }
  }
  std::vector<std::pair<int, int>> lines;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Eigen::Vector3d u = axes[i].unitOrthogonal(), v = axes[i].normalized().cross(u);
    std::sort(on[i].begin(), on[i].end(), [&](int a, int b) {
      return std::atan2(points[a].dot(v), points[a].dot(u)) <
             std::atan2(points[b].dot(v), points[b].dot(u));
    });
    for (std::size_t k = 0; k < on[i].size(); ++k)
      lines.emplace_back(on[i][k], on[i][(k + 1) % on[i].size()]);
  }
  return lines_of(points, lines);
}

/// Axes of great circles that cross at equal distances: three make an octahedron's edges, four a
/// cuboctahedron's, six an icosidodecahedron's.
inline std::vector<Eigen::Vector3d> regular_axes(int circles) {
  constexpr double kGolden = std::numbers::phi;
  switch (circles) {
    case 3:
      return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case 4:
      return {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    default:
      return {{0, 1, kGolden},  {1, kGolden, 0},  {kGolden, 0, 1},
              {0, 1, -kGolden}, {1, -kGolden, 0}, {-kGolden, 0, 1}};
  }
}

struct Triangles {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;
};

/// The weave over a surface: a joint in the middle of each edge, lines between those that follow
/// each other around a triangle. Of three families where triangles meet in sixes.
inline LineMesh weave_over(const Triangles& surface) {
  std::map<std::pair<int, int>, int> joints;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::pair<int, int>> lines;
  for (const auto& face : surface.faces) {
    int middles[3];
    for (int k = 0; k < 3; ++k) {
      const int a = face[k], b = face[(k + 1) % 3];
      const auto [found, is_new] =
          joints.emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (is_new) points.emplace_back(0.5 * (surface.points[a] + surface.points[b]));
      middles[k] = found->second;
    }
    for (int k = 0; k < 3; ++k) lines.emplace_back(middles[k], middles[(k + 1) % 3]);
  }
  return lines_of(points, lines);
}

/// Over a surface that closes on itself along u; along v after it is turned over or not.
template <class Point>
Triangles closed_surface(int along, int across, bool is_turned_over, const Point& point) {
  Triangles surface;
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < across; ++j)
      surface.points.push_back(
          point(2 * std::numbers::pi * i / along, 2 * std::numbers::pi * j / across));
  const auto number = [&](int i, int j) {
    if (i == along && is_turned_over) j = across - j;
    return i % along * across + j % across;
  };
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < across; ++j) {
      surface.faces.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1)});
      surface.faces.push_back({number(i, j), number(i + 1, j + 1), number(i, j + 1)});
    }
  }
  return surface;
}

inline Triangles torus(int along, int across, double radius, double tube) {
  return closed_surface(along, across, false, [&](double u, double v) -> Eigen::Vector3d {
    const double from_axis = radius + tube * std::cos(v);
    return {from_axis * std::cos(u), from_axis * std::sin(u), tube * std::sin(v)};
  });
}

/// A tube with the section of an eight that turns over by half a turn on its way.
inline Triangles klein_bottle(int along, int across) {
  return closed_surface(along, across, true, [&](double u, double v) -> Eigen::Vector3d {
    const double c = std::cos(u / 2), s = std::sin(u / 2);
    const double from_axis = 3 + c * std::sin(v) - s * std::sin(2 * v);
    return {from_axis * std::cos(u), from_axis * std::sin(u),
            s * std::sin(v) + c * std::sin(2 * v)};
  });
}

/// An icosahedron whose triangles are cut into four some times, on a unit ball.
inline Triangles ball(int times) {
  Triangles surface;
  for (const auto& axis : regular_axes(6)) {
    surface.points.push_back(axis.normalized());
    surface.points.push_back(-axis.normalized());
  }
  const double edge = 1 / std::sin(2 * std::numbers::pi / 5);
  const auto near = [&](int a, int b) {
    return std::abs((surface.points[a] - surface.points[b]).norm() - edge) < 1e-9;
  };
  for (int a = 0; a < 12; ++a)
    for (int b = 0; b < 12; ++b)
      for (int c = 0; c < 12; ++c)
        if (a < b && a < c && near(a, b) && near(b, c) && near(c, a) &&
            surface.points[a].dot(surface.points[b].cross(surface.points[c])) > 0)
          surface.faces.push_back({a, b, c});
  for (int time = 0; time < times; ++time) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, is_new] =
          middles.emplace(std::minmax(a, b), static_cast<int>(surface.points.size()));
      if (is_new) surface.points.push_back((surface.points[a] + surface.points[b]).normalized());
      return found->second;
    };
    std::vector<std::array<int, 3>> faces;
    for (const auto& [a, b, c] : surface.faces) {
      const int x = middle(a, b), y = middle(b, c), z = middle(c, a);
      for (const std::array<int, 3>& face :
           {std::array{a, x, z}, std::array{x, b, y}, std::array{z, y, c}, std::array{x, y, z}})
        faces.push_back(face);
    }
    surface.faces = std::move(faces);
  }
  return surface;
}

}  // namespace limber::rods::testing
