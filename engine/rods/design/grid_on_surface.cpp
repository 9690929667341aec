#include "engine/rods/design/grid_on_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/rods/design/principal_axes.h"

namespace limber::rods {
namespace {

double length_on_surface(const PatchLift& lift, const Eigen::Vector2d& from,
                         const Eigen::Vector2d& to) {
  constexpr int kPieces = 8;  // chords that measure a curve
  double length = 0;
  Eigen::Vector3d last = lift(from);
  for (int k = 1; k <= kPieces; ++k) {
    const Eigen::Vector3d next = lift(from + static_cast<double>(k) / kPieces * (to - from));
    length += (next - last).norm();
    last = next;
  }
  return length;
}

double crossing_angle(const GridLines& grid, const Eigen::Matrix3Xd& points) {
  double sum = 0;
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const Eigen::Vector3d along = points.col(grid.at(c + 1, r)) - points.col(grid.at(c, r)),
                            across = points.col(grid.at(c, r + 1)) - points.col(grid.at(c, r));
      sum += std::atan2(along.cross(across).norm(), along.dot(across));
    }
  }
  return sum / ((grid.rows - 1) * (grid.columns - 1));
}

/// 0 in the mean.
Eigen::VectorXd places(const Eigen::VectorXd& gaps) {
  Eigen::VectorXd at = Eigen::VectorXd::Zero(gaps.size() + 1);
  for (Eigen::Index i = 0; i < gaps.size(); ++i) at[i + 1] = at[i] + gaps[i];
  return at.array() - at.mean();
}

/// Spread of points about the plane nearest to them.
struct Spread {
  explicit Spread(const Eigen::Matrix3Xd& points) {
    const Eigen::Matrix3Xd offsets = points.colwise() - points.rowwise().mean();
    const Eigen::Array3Xd own = principal_axes(points).transpose() * offsets;
    height = std::sqrt(own.row(0).square().mean());
    const auto variance = [](const Eigen::ArrayXd& values) {
      return (values - values.mean()).square().mean();
    };
    dome = variance(own.row(2).square() + own.row(1).square());
    saddle = variance(own.row(2).square() - own.row(1).square());
  }
  /// Mean square height of z = (p^2 + q^2) / 2, or of the saddle; per Gaussian curvature.
  [[nodiscard]] double squared_height(double curvature) const {
    return (curvature < 0 ? saddle : dome) / 4;
  }
  double height = 0;  // root mean square [length]
  double dome = 0, saddle = 0;
};

}  // namespace

GridOnSurface::GridOnSurface(const PatchLift& lift, int columns, int rows, double margin)
    : lines(columns, rows), points(3, lines.joints()) {
  const auto place = [&](int vertex) -> Eigen::Vector2d {
    const Eigen::Vector2d at(static_cast<double>(vertex % columns) / (columns - 1),
                             static_cast<double>(vertex / columns) / (rows - 1));
    return Eigen::Vector2d::Constant(margin) + (1 - 2 * margin) * at;
  };
  for (int j = 0; j < points.cols(); ++j) points.col(j) = lift(place(j));
  lengths.resize(static_cast<Eigen::Index>(lines.edges.size()));
  for (Eigen::Index e = 0; e < lengths.size(); ++e) {
    const Eigen::Vector2i& edge = lines.edges[static_cast<std::size_t>(e)];
    lengths[e] = length_on_surface(lift, place(edge[0]), place(edge[1]));
  }
}

StraightLayout layout_of(const GridOnSurface& grid, double flat_angle) {
  const GridLines& lines = grid.lines;
  const auto across = Eigen::Index{lines.rows} * (lines.columns - 1);
  // A column for each row's edges, a column for each column's.
  const Eigen::Map<const Eigen::MatrixXd> of_rows(grid.lengths.data(), lines.columns - 1,
                                                  lines.rows),
      of_columns(grid.lengths.data() + across, lines.rows - 1, lines.columns);
  StraightLayout layout;
  layout.columns = places(of_rows.rowwise().mean());
  layout.rows = places(of_columns.rowwise().mean());
  const auto growth = [](const Eigen::MatrixXd& lengths, const Eigen::VectorXd& at) {
    const Eigen::VectorXd sums = lengths.array().log().colwise().mean();
    return at.dot(sums) / at.squaredNorm();
  };
  layout.rows_widen = growth(of_rows, layout.rows);
  layout.columns_widen = growth(of_columns, layout.columns);
  layout.flat_angle = flat_angle;
  layout.open_angle = crossing_angle(lines, grid.points);
  layout.curvature = grid_curvature(lines, grid.points);
  // A surface that curves in one direction only, or to both sides by turns, would be drawn with
  // parallel rods. They stay in their plane, and a search does not leave it.
  constexpr double kLeast = 0.45;  // of the surface's height
  const Spread spread(grid.points);
  double& mean = layout.curvature.mean;
  const double least = std::pow(kLeast * spread.height, 2) / spread.squared_height(mean);
  if (std::abs(mean) < least) mean = std::copysign(least, mean);
  return layout;
}

Eigen::VectorXd heights_of(const GridOnSurface& grid) {
  const int right = grid.lines.columns - 1, top = grid.lines.rows - 1;
  const auto corner = [&](int c, int r) -> Eigen::Vector3d {
    return grid.points.col(grid.lines.at(c, r));
  };
  const Eigen::Vector3d upward =
      (corner(right, top) - corner(0, 0)).cross(corner(0, top) - corner(right, 0));
  const Eigen::Matrix3Xd offsets = grid.points.colwise() - grid.points.rowwise().mean();
  const Eigen::Vector3d normal = principal_axes(grid.points).col(0);
  return std::copysign(1.0, normal.dot(upward)) * (offsets.transpose() * normal);
}

double height_of(const Eigen::Matrix3Xd& points) { return Spread(points).height; }

double curved_height(const Eigen::Matrix3Xd& points, double mean_curvature) {
  constexpr double kUneven = 1.5;  // of the squared height, added by unlike principal curvatures
  const Spread spread(points);
  return std::min(spread.height, std::sqrt(kUneven * std::abs(mean_curvature) *
                                           spread.squared_height(mean_curvature)));
}

}  // namespace limber::rods
