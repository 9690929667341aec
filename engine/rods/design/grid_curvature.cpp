#include "engine/rods/design/grid_curvature.h"

#include <Eigen/Geometry>
#include <cmath>

namespace limber::rods {

GridCurvature grid_curvature(const GridLines& grid, const Eigen::Matrix3Xd& points) {
  const int columns = grid.columns - 2, rows = grid.rows - 2;
  Eigen::MatrixXd curved(columns, rows), areas(columns, rows);
  double bent = 0, twisted = 0;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const auto x = [&](int dc, int dr) -> Eigen::Vector3d {
        return points.col(grid.at(c + 1 + dc, r + 1 + dr));
      };
      const Eigen::Vector3d u = 0.5 * (x(1, 0) - x(-1, 0)), v = 0.5 * (x(0, 1) - x(0, -1));
      const Eigen::Vector3d uu = x(1, 0) - 2 * x(0, 0) + x(-1, 0),
                            vv = x(0, 1) - 2 * x(0, 0) + x(0, -1),
                            uv = 0.25 * (x(1, 1) - x(1, -1) - x(-1, 1) + x(-1, -1));
      const Eigen::Vector3d across = u.cross(v);
      const Eigen::Vector3d normal = across.normalized();
      areas(c, r) = across.norm();
      const double bend = normal.dot(uu) * normal.dot(vv), twist = std::pow(normal.dot(uv), 2);
      curved(c, r) = (bend - twist) / areas(c, r);
      bent += std::abs(bend) / areas(c, r);
      twisted += twist / areas(c, r);
    }
  }
  GridCurvature curvature;
  curvature.mean = curved.sum() / areas.sum();
  if (twisted > 0) curvature.twist = twisted / (bent + twisted);
  const auto with_rim = [&](const Eigen::VectorXd& within) {
    Eigen::VectorXd all(within.size() + 2);
    all << within[0], within, within[within.size() - 1];
    return Eigen::VectorXd(all.array() - curvature.mean);
  };
  curvature.columns = with_rim(curved.rowwise().sum().cwiseQuotient(areas.rowwise().sum()));
  curvature.rows =
      with_rim(curved.colwise().sum().cwiseQuotient(areas.colwise().sum()).transpose());
  return curvature;
}

}  // namespace limber::rods
