#include "engine/rods/design/straight_layout.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/rods/design/layout_drive.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {
namespace {

/// Points of z = height(x, y), x and y to 1.
template <class Height>
Eigen::Matrix3Xd points_of(const GridLines& grid, const Height& height) {
  Eigen::Matrix3Xd points(3, grid.joints());
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const double x = 2.0 * c / (grid.columns - 1) - 1, y = 2.0 * r / (grid.rows - 1) - 1;
      points.col(grid.at(c, r)) << x, y, height(x, y);
    }
  }
  return points;
}

TEST(GridCurvature, IsThatOfQuadrics) {
  const GridLines grid(9, 7);
  const auto mean = [&](double a, double b, double c) {
    return grid_curvature(grid, points_of(grid,
                                          [&](double x, double y) {
                                            return 0.5 * (a * x * x + b * y * y) + c * x * y;
                                          }))
        .mean;
  };
  EXPECT_NEAR(mean(0.1, 0.2, 0), 0.02, 0.001);
  EXPECT_NEAR(mean(-0.1, -0.2, 0), 0.02, 0.001);
  EXPECT_NEAR(mean(0.1, -0.2, 0), -0.02, 0.001);
  EXPECT_NEAR(mean(0, 0, 0.2), -0.04, 0.002) << "rods along which the surface is straight";
  EXPECT_NEAR(mean(0.3, 0, 0), 0, 1e-12);
  EXPECT_TRUE(grid_curvature(grid, points_of(grid, [](double, double) { return 0.0; })).vanishes());
}

TEST(GridCurvature, ChangesAlongColumnsAndRows) {
  const GridLines grid(15, 15);
  // K = z_xx z_yy to first order, z_xx = 0.06 + 0.06 x, z_yy = 0.06.
  const GridCurvature curvature =
      grid_curvature(grid, points_of(grid, [](double x, double y) {
                       return 0.03 * x * x + 0.01 * x * x * x + 0.03 * y * y;
                     }));
  for (int c = 1; c + 1 < grid.columns; ++c)
    EXPECT_NEAR(curvature.columns[c], 0.0036 * (2.0 * c / 14 - 1), 0.0001) << c;
  EXPECT_EQ(curvature.columns[0], curvature.columns[1]);
  EXPECT_LT(curvature.rows.cwiseAbs().maxCoeff(), 0.0001);
}

Eigen::VectorXd places(int count, double extent) {
  return Eigen::VectorXd::LinSpaced(count, -extent / 2, extent / 2);
}

StraightLayout layout_for(const GridLines& grid, double curvature) {
  StraightLayout layout;
  layout.columns = places(grid.columns, 2);
  layout.rows = places(grid.rows, 1.6);
  layout.flat_angle = 0.5;
  layout.open_angle = 1.5;
  layout.curvature = {curvature, Eigen::VectorXd::Zero(grid.columns),
                      Eigen::VectorXd::Zero(grid.rows)};
  return layout;
}

/// Opened with rods that bend sideways hardly at all, and in the other directions as easily: they
/// follow the lengths. From a flat drawing that is nudged out of its plane.
Eigen::Matrix3Xd opened(const GridLines& grid, const StraightLayout& layout) {
  LineMesh lines;
  lines.vertices = draw(grid, layout);
  lines.edges.resize(2, static_cast<Eigen::Index>(grid.edges.size()));
  for (Eigen::Index e = 0; e < lines.edges.cols(); ++e)
    lines.edges.col(e) = grid.edges[static_cast<std::size_t>(e)];
  const LinkageModel model(build_linkage_graph(lines), 5, {1e6, 1, 1e-4, 1e-4});
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions open;
  open.mean_opening_angle = layout.open_angle;
  const DeploymentReport report = deploy(equilibrium, state, open);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  return joint_positions(state);
}

TEST(StraightLayout, OpensToTheCurvatureItIsDrawnFor) {
  const GridLines grid(7, 7);
  for (const double wanted : {0.05, -0.05, 0.15, -0.15}) {
    const double found = grid_curvature(grid, opened(grid, layout_for(grid, wanted))).mean;
    EXPECT_NEAR(found, wanted, 0.25 * std::abs(wanted));
  }
}

TEST(StraightLayout, OpensToCurvatureThatChangesAlongItsRods) {
  const GridLines grid(9, 7);
  StraightLayout layout = layout_for(grid, 0.1);
  layout.curvature.columns = 0.04 * layout.columns;
  const GridCurvature found = grid_curvature(grid, opened(grid, layout));
  EXPECT_NEAR(found.mean, 0.1, 0.025);
  const Eigen::VectorXd within = layout.columns.segment(1, 7);
  const double slope = within.dot(found.columns.segment(1, 7)) / within.squaredNorm();
  EXPECT_GT(slope, 0.02);
  EXPECT_LT(slope, 0.08) << "to first order it is 0.04";
}

TEST(StraightLayout, HasEdgesThatAreAsLongInTheMean) {
  const GridLines grid(7, 5);
  StraightLayout layout = layout_for(grid, 0.1);
  layout.columns << -1, -0.6, -0.4, 0, 0.1, 0.5, 1;
  layout.rows << -0.9, -0.3, 0, 0.4, 0.8;
  const Eigen::Matrix3Xd points = draw(grid, layout);
  EXPECT_EQ(points.row(2).norm(), 0);
  const auto direction = [&](int from, int to) {
    return std::atan2(points(1, to) - points(1, from), points(0, to) - points(0, from));
  };
  double angle = 0;
  for (int c = 0; c < 7; ++c) angle += direction(grid.at(c, 0), grid.at(c, 4)) / 7;
  for (int r = 0; r < 5; ++r) angle -= direction(grid.at(0, r), grid.at(6, r)) / 5;
  EXPECT_NEAR(angle, layout.flat_angle, 1e-12) << "of all joints, rods being straight";
  const auto apart = [&](int from, int to) { return (points.col(to) - points.col(from)).norm(); };
  for (int c = 0; c + 1 < 7; ++c) {
    double sum = 0;
    for (int r = 0; r < 5; ++r) sum += apart(grid.at(c, r), grid.at(c + 1, r)) / 5;
    EXPECT_NEAR(sum, layout.columns[c + 1] - layout.columns[c], 1e-3) << c;
  }
  for (int r = 0; r + 1 < 5; ++r) {
    double sum = 0;
    for (int c = 0; c < 7; ++c) sum += apart(grid.at(c, r), grid.at(c, r + 1)) / 7;
    EXPECT_NEAR(sum, layout.rows[r + 1] - layout.rows[r], 1e-3) << r;
  }
}

TEST(StraightLayout, ThatBendsTooMuchIsDetected) {
  const GridLines grid(7, 7);
  EXPECT_TRUE(is_regular(grid, draw(grid, layout_for(grid, 0.1)), 0.25));
  StraightLayout crossed = layout_for(grid, -3);
  EXPECT_FALSE(is_regular(grid, draw(grid, crossed), 0.25));
  curve_less(crossed, 0);
  EXPECT_TRUE(is_regular(grid, draw(grid, crossed), 0.25));
  EXPECT_FALSE(is_regular(grid, draw(grid, crossed), 0.6)) << "0.5 is its angle";
}

TEST(LayoutDrive, BringsTheOpenedGridToAHeight) {
  const GridLines grid(6, 6);
  const StraightLayout layout = layout_for(grid, 0.04);
  const Rectangle strip{0.02, 0.004};
  double last = 0;
  for (const double height : {0.02, 0.04, 0.06}) {
    const LayoutDrive found = drive_to_height(grid, layout, height, 0.25, strip);
    EXPECT_TRUE(found.has_opened);
    EXPECT_NEAR(found.height, height, 0.05 * height);
    EXPECT_GT(found.drive, last);
    last = found.drive;
  }
  // Thick rods stay in the plane as far as there is room in it.
  EXPECT_LT(drive_to_height(grid, layout, 0.04, 0.45, Rectangle{0.06, 0.06}).height, 0.001);
}

}  // namespace
}  // namespace limber::rods
