#include "engine/rods/design/straight_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace limber::rods {
namespace {

/// Trapezoids, from where x is 0.
Eigen::VectorXd integral(const Eigen::VectorXd& x, const Eigen::VectorXd& values) {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(x.size());
  for (Eigen::Index i = 1; i < x.size(); ++i)
    sums[i] = sums[i - 1] + 0.5 * (values[i] + values[i - 1]) * (x[i] - x[i - 1]);
  Eigen::Index right = 1;
  while (right + 1 < x.size() && x[right] < 0) ++right;
  const double share = -x[right - 1] / (x[right] - x[right - 1]);
  const double middle = sums[right - 1] + share * (sums[right] - sums[right - 1]);
  return sums.array() - middle;
}

constexpr int kSizings = 6;  // lengths gain a digit in each

Eigen::Vector2d unit_direction(double angle) { return {std::cos(angle), std::sin(angle)}; }

double cross_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Crossings of the rods of columns, through places along x, with those of rows, through places
/// along `upward`; 3 x joints.
Eigen::Matrix3Xd crossings(const GridLines& grid, const Eigen::VectorXd& columns,
                           const Eigen::VectorXd& column_angles, const Eigen::VectorXd& rows,
                           const Eigen::VectorXd& row_angles, const Eigen::Vector2d& upward) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, grid.joints());
  for (int r = 0; r < grid.rows; ++r) {
    const Eigen::Vector2d begin = rows[r] * upward, along = unit_direction(row_angles[r]);
    for (int c = 0; c < grid.columns; ++c) {
      const Eigen::Vector2d across = unit_direction(column_angles[c]);
      const Eigen::Vector2d offset = columns[c] * Eigen::Vector2d::UnitX() - begin;
      points.col(grid.at(c, r)).head<2>() =
          begin + cross_product(offset, across) / cross_product(along, across) * along;
    }
  }
  return points;
}

/// Places whose gaps grow by the missing part of the required lengths.
template <class Length>
void stretch(Eigen::VectorXd& places, const Eigen::VectorXd& target_places, const Length& length) {
  const Eigen::VectorXd last = places;
  places[0] = 0;
  for (int i = 0; i + 1 < places.size(); ++i) {
    places[i + 1] =
        places[i] + (last[i + 1] - last[i]) * (target_places[i + 1] - target_places[i]) / length(i);
  }
  places.array() -= places.mean();
}

}  // namespace

Eigen::Matrix3Xd draw(const GridLines& grid, const StraightLayout& layout) {
  const double c0 = std::cos(layout.flat_angle), s0 = std::sin(layout.flat_angle);
  const double c1 = std::cos(layout.open_angle), s1 = std::sin(layout.open_angle);
  // Share of K in -f' and -g'.
  const double share = layout.curvature.vanishes() ? 0 : 2 * std::pow(s0 * s1, 2) / (c0 - c1);
  const double half = 0.5 * layout.curvature.mean;
  const double f_0 = layout.columns_widen - c0 * layout.rows_widen,
               g_0 = layout.rows_widen - c0 * layout.columns_widen;
  const auto turns = [&](const Eigen::VectorXd& places, const Eigen::VectorXd& deviations,
                         double at_middle) {
    const Eigen::VectorXd own = (half + deviations.array()).matrix();
    const Eigen::VectorXd slopes = at_middle - share * integral(places, own).array();
    const Eigen::VectorXd angles = integral(places, slopes) / s0;
    return Eigen::VectorXd(angles.array() -
                           angles.mean());  // so that rods cross at alpha_0 in the mean
  };
  const Eigen::VectorXd of_columns = turns(layout.columns, layout.curvature.columns, g_0);
  const Eigen::VectorXd of_rows = turns(layout.rows, layout.curvature.rows, f_0);
  Eigen::VectorXd columns = layout.columns, rows = layout.rows;  // along the middle rods
  for (int k = 0;; ++k) {
    Eigen::Matrix3Xd points = crossings(grid, columns, of_columns.array() * -1 + layout.flat_angle,
                                        rows, of_rows, unit_direction(layout.flat_angle));
    if (k == kSizings) return points;
    stretch(columns, layout.columns, [&](int c) {
      double sum = 0;
      for (int r = 0; r < grid.rows; ++r)
        sum += (points.col(grid.at(c + 1, r)) - points.col(grid.at(c, r))).norm();
      return sum / grid.rows;
    });
    stretch(rows, layout.rows, [&](int r) {
      double sum = 0;
      for (int c = 0; c < grid.columns; ++c)
        sum += (points.col(grid.at(c, r + 1)) - points.col(grid.at(c, r))).norm();
      return sum / grid.columns;
    });
  }
}

void fan_less(StraightLayout& layout, double share) {
  layout.rows_widen *= share;
  layout.columns_widen *= share;
}

void curve_less(StraightLayout& layout, double share) {
  layout.curvature.mean *= share;
  layout.curvature.columns *= share;
  layout.curvature.rows *= share;
}

bool is_regular(const GridLines& grid, const Eigen::Matrix3Xd& points, double least_angle) {
  constexpr double kShortest = 0.3;  // of the mean edge of its row or column
  if (!points.allFinite()) return false;
  const auto offset = [&](int from, int to) -> Eigen::Vector2d {
    return (points.col(to) - points.col(from)).head<2>();
  };
  const auto is_even = [&](int joints, const auto& joint) {
    double sum = 0, least = std::numeric_limits<double>::infinity();
    for (int i = 0; i + 1 < joints; ++i) {
      const double length = offset(joint(i), joint(i + 1)).norm();
      sum += length;
      least = std::min(least, length);
    }
    return least * (joints - 1) >= kShortest * sum;
  };
  for (int r = 0; r < grid.rows; ++r)
    if (!is_even(grid.columns, [&](int c) { return grid.at(c, r); })) return false;
  for (int c = 0; c < grid.columns; ++c)
    if (!is_even(grid.rows, [&](int r) { return grid.at(c, r); })) return false;
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      for (int k = 0; k < 4; ++k) {
        const int dc = k % 2, dr = k / 2;
        const Eigen::Vector2d along = offset(grid.at(c, r + dr), grid.at(c + 1, r + dr)),
                              across = offset(grid.at(c + dc, r), grid.at(c + dc, r + 1));
        const double angle = std::atan2(cross_product(along, across), along.dot(across));
        if (angle < least_angle || angle > std::numbers::pi - least_angle) return false;
      }
    }
  }
  return true;
}

}  // namespace limber::rods
