#include "engine/rods/design/grid_on_surface.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace limber::rods {
namespace {

double length_on_surface(const PatchLift& lift, const Eigen::Vector2d& from,
                         const Eigen::Vector2d& to) {
  constexpr int kPieces = 8;
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
  return layout;
}

GridHold hold_of(const GridOnSurface& grid) {
  constexpr double kFar = 2;  // times what the middle joint rises
  const GridLines& lines = grid.lines;
  const Eigen::Vector3d mean = grid.points.rowwise().mean();
  const auto at = [&](int c, int r) -> GridHold {
    const auto x = [&](int column, int row) -> Eigen::Vector3d {
      return grid.points.col(
          lines.at(std::clamp(column, 0, lines.columns - 1), std::clamp(row, 0, lines.rows - 1)));
    };
    const Eigen::Vector3d normal = (x(c + 1, r) - x(c - 1, r)).cross(x(c, r + 1) - x(c, r - 1));
    return {lines.at(c, r), normal.normalized().dot(x(c, r) - mean)};
  };
  const int column = lines.columns / 2, row = lines.rows / 2;
  const GridHold middle = at(column, row);
  GridHold best = middle;
  const auto consider = [&](const GridHold& other) {
    if (std::abs(other.rise) > std::abs(best.rise)) best = other;
  };
  for (int c = 0; c < lines.columns; ++c) consider(at(c, row));
  for (int r = 0; r < lines.rows; ++r) consider(at(column, r));
  return std::abs(best.rise) > kFar * std::abs(middle.rise) ? best : middle;
}

double curved_height(const Eigen::Matrix3Xd& points, double mean_curvature) {
  constexpr double kUneven = 1.5;  // of the squared height, what unlike principal curvatures add
  const Eigen::Matrix3Xd offsets = points.colwise() - points.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(offsets * offsets.transpose());
  const Eigen::Matrix3Xd own = axes.eigenvectors().transpose() * offsets;
  const double sign = mean_curvature > 0 ? 1 : -1;
  const Eigen::ArrayXd quadric = own.row(2).array().square() + sign * own.row(1).array().square();
  const double variance = (quadric - quadric.mean()).square().mean();
  return std::sqrt(std::min(own.row(0).array().square().mean(),
                            kUneven * std::abs(mean_curvature) / 4 * variance));
}

}  // namespace limber::rods
