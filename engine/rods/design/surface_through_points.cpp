#include "engine/rods/design/surface_through_points.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <boost/polygon/voronoi.hpp>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/numerics/median.h"

namespace limber::rods {
namespace {

using Cell = boost::polygon::point_data<int>;

[[noreturn]] void refuse_points(const std::string& field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

/// Principal axes of the points, the one across their plane first.
Eigen::Matrix3d axes_of(const Eigen::Matrix3Xd& points) {
  if (points.cols() < 3) refuse_points("points", fmt::format("{} make no surface", points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite()) refuse_points(fmt::format("points[{}]", i), "must be finite");
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(centred * centred.transpose());
  constexpr double kLine = 1e-12;  // squared width over squared length
  if (!(eigen.eigenvalues()[1] > kLine * eigen.eigenvalues()[2]))
    refuse_points("points", "lie on a line: they make no surface");
  return eigen.eigenvectors();
}

/// In the plane, on a grid: the library's predicates are exact on integers, so that nearly equal
/// circles cannot tear the triangulation.
std::vector<Cell> gridded(const Eigen::Matrix3Xd& points, const Eigen::Matrix3d& axes) {
  const Eigen::Matrix2Xd flat = axes.rightCols<2>().transpose() * points;
  const Eigen::Vector2d low = flat.rowwise().minCoeff();
  const double size = (flat.rowwise().maxCoeff() - low).maxCoeff();
  constexpr double kGrid = 1 << 28;  // cells along the longer side of the plane's extent
  std::vector<Cell> result;
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const Eigen::Vector2d x = (flat.col(i) - low) / size * kGrid;
    result.emplace_back(static_cast<int>(std::lround(x.x())), static_cast<int>(std::lround(x.y())));
  }
  std::vector<std::pair<Cell, int>> sorted;
  for (std::size_t i = 0; i < result.size(); ++i)
    sorted.emplace_back(result[i], static_cast<int>(i));
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].first != sorted[i - 1].first) continue;
    refuse_points(
        fmt::format("points[{}]", sorted[i].second),
        fmt::format("is above point {}: they are on no height field", sorted[i - 1].second));
  }
  return result;
}

std::vector<Eigen::Vector3i> delaunay(const std::vector<Cell>& points) {
  boost::polygon::voronoi_diagram<double> diagram;
  boost::polygon::construct_voronoi(points.begin(), points.end(), &diagram);
  std::vector<Eigen::Vector3i> triangles;
  for (const auto& vertex : diagram.vertices()) {
    // Points on one circle share a vertex: a fan.
    std::vector<int> around;
    const auto* edge = vertex.incident_edge();
    do {
      around.push_back(static_cast<int>(edge->cell()->source_index()));
      edge = edge->rot_next();
    } while (edge != vertex.incident_edge());
    for (std::size_t k = 2; k < around.size(); ++k)
      triangles.emplace_back(around[0], around[k - 1], around[k]);
  }
  return triangles;
}

double longest_side(const Eigen::Matrix3Xd& points, const Eigen::Vector3i& triangle) {
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest =
        std::max(longest, (points.col(triangle[k]) - points.col(triangle[(k + 1) % 3])).norm());
  return longest;
}

/// Median of the triangles' longest sides. Those across hollows of the rim are few.
double spacing(const Eigen::Matrix3Xd& points, const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<double> sides;
  for (const Eigen::Vector3i& triangle : triangles) sides.push_back(longest_side(points, triangle));
  return median(std::move(sides));
}

/// Slivers of the rim may stand on end, whole regions may not.
void demand_height_field(const SurfaceMesh& mesh, const Eigen::Vector3d& up, double steepest) {
  constexpr double kMaxSteepShare = 0.1;  // of the area: more is not a height field
  double area = 0, steep = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Matrix3d corner = corners(mesh, t);
    const Eigen::Vector3d normal =
        (corner.col(1) - corner.col(0)).cross(corner.col(2) - corner.col(0));
    area += normal.norm();
    if (std::abs(normal.dot(up)) < std::cos(steepest) * normal.norm()) steep += normal.norm();
  }
  if (steep <= kMaxSteepShare * area) return;
  refuse_points(
      "points",
      fmt::format("are no height field over their plane: {:.0f} % of the surface is steeper "
                  "than {:.0f} degrees",
                  100 * steep / area, steepest * (180 / std::numbers::pi)));
}

}  // namespace

void PointSurfaceOptions::validate() const {
  if (!(largest_gap >= 0) || !std::isfinite(largest_gap))
    refuse_points("largest_gap", fmt::format("must be >= 0 and finite, is {:g}", largest_gap));
  if (!(steepest > 0 && steepest < std::numbers::pi / 2))
    refuse_points("steepest", fmt::format("must be in (0, pi/2), is {:g}", steepest));
}

SurfaceMesh surface_through_points(const Eigen::Matrix3Xd& points,
                                   const PointSurfaceOptions& options) {
  options.validate();
  const Eigen::Matrix3d axes = axes_of(points);
  std::vector<Eigen::Vector3i> triangles = delaunay(gridded(points, axes));
  constexpr double kGaps = 4;  // of the spacing: longer sides are holes or the outside
  const double gap =
      options.largest_gap > 0 ? options.largest_gap : kGaps * spacing(points, triangles);
  std::erase_if(triangles, [&](const Eigen::Vector3i& triangle) {
    return longest_side(points, triangle) > gap;
  });
  SurfaceMesh mesh{points, Eigen::Matrix3Xi(3, static_cast<Eigen::Index>(triangles.size()))};
  for (std::size_t t = 0; t < triangles.size(); ++t)
    mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  check_surface_mesh(mesh);
  demand_height_field(mesh, axes.col(0), options.steepest);
  return mesh;
}

}  // namespace limber::rods
