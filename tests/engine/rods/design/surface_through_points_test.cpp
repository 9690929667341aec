#include "engine/rods/design/surface_through_points.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/rods/design/mesh_surface.h"

namespace limber::rods {
namespace {

double height(double x, double y) { return 0.3 * std::sin(x) * std::cos(0.8 * y); }

/// Scattered over a square of side 6, tilted in space.
Eigen::Matrix3Xd scattered(int count, const Eigen::Quaterniond& tilt) {
  Random random(7);
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(0, 6), y = random.uniform(0, 6);
    points.col(i) = tilt * Eigen::Vector3d(x, y, height(x, y));
  }
  return points;
}

std::string refused_points(const Eigen::Matrix3Xd& points,
                           const PointSurfaceOptions& options = {}) {
  try {
    (void)surface_through_points(points, options);
  } catch (const Error& error) {
    return error.field();
  }
  return "none";
}

TEST(SurfaceThroughPoints, IsNearTheSurfaceThatTheyWereTakenFrom) {
  const Eigen::Quaterniond tilt = Eigen::Quaterniond(0.5, 0.3, -0.8, 0.1).normalized();
  const Eigen::Matrix3Xd points = scattered(3000, tilt);
  const MeshSurface surface(surface_through_points(points));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    EXPECT_LT((surface.closest(points.col(i)).position - points.col(i)).norm(), 1e-12);
  Random random(9);
  for (int k = 0; k < 500; ++k) {
    const double x = random.uniform(0.5, 5.5), y = random.uniform(0.5, 5.5);
    const Eigen::Vector3d at = tilt * Eigen::Vector3d(x, y, height(x, y));
    EXPECT_LT((surface.closest(at).position - at).norm(), 0.02);
  }
}

TEST(SurfaceThroughPoints, TrianglesAreDelaunaysAndMeetInPairs) {
  const Eigen::Matrix3Xd points = scattered(300, Eigen::Quaterniond::Identity());
  Eigen::Matrix3Xd flat = points;
  flat.row(2).setZero();
  const SurfaceMesh mesh = surface_through_points(flat, {.largest_gap = 100});
  std::map<std::pair<int, int>, int> sides;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3i corner = mesh.triangles.col(t);
    for (int k = 0; k < 3; ++k) ++sides[std::minmax(corner[k], corner[(k + 1) % 3])];
    const Eigen::Matrix3d x = corners(mesh, t);
    Eigen::Matrix2d system;
    system << (x.col(1) - x.col(0)).head<2>().transpose(),
        (x.col(2) - x.col(0)).head<2>().transpose();
    const Eigen::Vector2d squares(0.5 * (x.col(1) - x.col(0)).squaredNorm(),
                                  0.5 * (x.col(2) - x.col(0)).squaredNorm());
    const Eigen::Vector2d centre = system.inverse() * squares;
    for (Eigen::Index i = 0; i < flat.cols(); ++i) {
      const Eigen::Vector2d from = (flat.col(i) - x.col(0)).head<2>();
      EXPECT_GE((from - centre).norm(), centre.norm() * (1 - 1e-5));
    }
  }
  int rim = 0;
  for (const auto& [side, times] : sides) {
    EXPECT_LE(times, 2);
    if (times == 1) ++rim;
  }
  // Euler: triangles = 2 n - 2 - rim.
  EXPECT_EQ(mesh.triangles.cols(), 2 * 300 - 2 - rim);
}

TEST(SurfaceThroughPoints, HolesStayOpen) {
  const Eigen::Matrix3Xd all = scattered(3000, Eigen::Quaterniond::Identity());
  std::vector<Eigen::Vector3d> kept;
  for (Eigen::Index i = 0; i < all.cols(); ++i)
    if ((all.col(i).head<2>() - Eigen::Vector2d(3, 3)).norm() > 1) kept.emplace_back(all.col(i));
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) points.col(static_cast<Eigen::Index>(i)) = kept[i];
  const Eigen::Vector3d middle(3, 3, height(3, 3));
  EXPECT_GT((MeshSurface(surface_through_points(points)).closest(middle).position - middle).norm(),
            0.5);
  const MeshSurface spanned(surface_through_points(points, {.largest_gap = 10}));
  EXPECT_LT((spanned.closest(middle).position - middle).norm(), 0.5);
}

TEST(SurfaceThroughPoints, AGridOfPointsOnCommonCirclesIsCovered) {
  Eigen::Matrix3Xd points(3, 25);
  for (int i = 0; i < 25; ++i) points.col(i) << i % 5, i / 5, 0;
  EXPECT_EQ(surface_through_points(points).triangles.cols(), 32);
}

TEST(SurfaceThroughPoints, BadInputIsNamed) {
  EXPECT_EQ(refused_points(Eigen::Matrix3Xd::Random(3, 2)), "points");
  Eigen::Matrix3Xd points = scattered(50, Eigen::Quaterniond::Identity());
  points(1, 7) = std::nan("");
  EXPECT_EQ(refused_points(points), "points[7]");
  Eigen::Matrix3Xd line(3, 10);
  for (int i = 0; i < 10; ++i) line.col(i) = i * Eigen::Vector3d(1, 2, 3);
  EXPECT_EQ(refused_points(line), "points");
  points = scattered(50, Eigen::Quaterniond::Identity());
  points.col(31) = points.col(12);
  EXPECT_EQ(refused_points(points), "points[31]");
  // A tube stands over no plane.
  Eigen::Matrix3Xd tube(3, 400);
  for (int i = 0; i < 400; ++i)
    tube.col(i) << std::cos(0.31 * i), std::sin(0.31 * i), 0.013 * i + 1e-3 * std::sin(7.0 * i);
  EXPECT_EQ(refused_points(tube), "points");
  EXPECT_EQ(refused_points(scattered(50, Eigen::Quaterniond::Identity()), {.largest_gap = -1}),
            "largest_gap");
  EXPECT_EQ(refused_points(scattered(50, Eigen::Quaterniond::Identity()), {.steepest = 2}),
            "steepest");
}

}  // namespace
}  // namespace limber::rods
