// Patches whose axes or corners are not plain to see.

#include "engine/rods/design/patch_corners.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/rods/design/patch_map.h"
#include "tests/engine/rods/design/small_patches.h"

namespace limber::rods {
namespace {

using testing::field;

/// The map is of the surface, not of its file.
void demand_same_whatever_the_order(const SurfaceMesh& mesh) {
  const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
  const auto count = static_cast<int>(mesh.vertices.cols());
  for (const int stride : {5, 7, 100}) {
    if (std::gcd(stride, count) > 1) continue;
    SurfaceMesh shuffled = mesh;
    for (int v = 0; v < count; ++v)
      shuffled.vertices.col((v * stride + count / 2) % count) = mesh.vertices.col(v);
    for (int& vertex : shuffled.triangles.reshaped())
      vertex = (vertex * stride + count / 2) % count;
    if (stride == 7) shuffled.triangles.row(0).swap(shuffled.triangles.row(1));
    const Eigen::Matrix2Xd again = map_patch_to_square(shuffled);
    for (int v = 0; v < count; ++v) {
      EXPECT_LT((again.col((v * stride + count / 2) % count) - map.col(v)).norm(), 1e-9)
          << "vertex " << v << ", every " << stride;
    }
  }
}

/// Which corner comes first and which orientation depends on the surface, not of its file.
TEST(PatchCorners, DirectionsDoNotDependOnTheOrderOfVertices) {
  SurfaceMesh mesh =
      field(12, [](double x, double y) { return 20 * x * x - 15 * y * y + 4 * x * y; });
  mesh.vertices.row(1) *= 1.5;  // longer along y
  const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
  EXPECT_LT((map.rightCols<1>() - Eigen::Vector2d(1, 0)).norm(), 1e-12);  // first along y, upright
  EXPECT_LT((map.col(0) - Eigen::Vector2d(0, 1)).norm(), 1e-12);
  demand_same_whatever_the_order(mesh);
}

SurfaceMesh turned(SurfaceMesh mesh, double degrees, const Eigen::Vector3d& about) {
  mesh.vertices =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about).toRotationMatrix() * mesh.vertices;
  return mesh;
}

/// The axes of a square are arbitrary: sides may lie across their diagonals.
TEST(PatchCorners, OfSquaresAreTheirs) {
  for (const double height : {0.0, 20.0}) {
    const SurfaceMesh square =
        field(12, [&](double x, double y) { return height * (1 - x * x) * (1 - y * y); });
    for (const double degrees : {0.0, 15.0, 45.0, 90.0, 135.0}) {
      for (const Eigen::Vector3d& about :
           {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, 0).normalized().eval()}) {
        SCOPED_TRACE(degrees);
        const SurfaceMesh mesh = turned(square, degrees, about);
        const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
        for (const int corner : {0, 12, 12 * 13, 12 * 13 + 12})
          EXPECT_LT((map.col(corner) - map.col(corner).array().round().matrix()).norm(), 1e-12);
        demand_same_whatever_the_order(mesh);
      }
    }
  }
}

TEST(PatchCorners, OfDirectionsAsNearToAnAxisTheOneBetweenForwardDirectionsIsFirst) {
  const SurfaceMesh square = field(4, [](double, double) { return 0.0; });
  for (const double degrees : {45.0, 135.0, 225.0, 315.0}) {
    const SurfaceMesh mesh = turned(square, degrees, Eigen::Vector3d::UnitZ());
    const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
    for (Eigen::Index v = 0; v < map.cols(); ++v) {
      const Eigen::Vector3d x = mesh.vertices.col(v) / 200;
      const Eigen::Vector2d at((x.x() + x.y()) / std::sqrt(2) + 0.5,
                               (x.y() - x.x()) / std::sqrt(2) + 0.5);
      EXPECT_LT((map.col(v) - at).norm(), 1e-9) << degrees;
    }
  }
  // Forward along x, which is as near as y, also where rounding says otherwise.
  SurfaceMesh oblong = square;
  oblong.vertices.row(1) *= 2;
  for (const double degrees : {45.0, 225.0}) {
    for (const double off : {-1e-10, 1e-10}) {
      const SurfaceMesh mesh = turned(oblong, degrees + off, Eigen::Vector3d::UnitZ());
      const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
      Eigen::Index right = 0;
      mesh.vertices.row(0).maxCoeff(&right);
      EXPECT_GT(map(0, right), 0.5) << degrees;
    }
  }
}

/// Rings of a regular polygon about its middle.
SurfaceMesh disk(int corners, int rings) {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, Eigen::Index{corners} * rings + 1);
  std::vector<Eigen::Vector3i> triangles;
  for (int r = 1; r <= rings; ++r) {
    for (int c = 0; c < corners; ++c) {
      const double angle = 2 * std::numbers::pi * c / corners;
      const auto at = [&](int ring, int k) {
        return ring == 0 ? 0 : 1 + (ring - 1) * corners + k % corners;
      };
      mesh.vertices.col(at(r, c)) << r * std::cos(angle), r * std::sin(angle), 0.1 * r * r;
      triangles.emplace_back(at(r, c), at(r, c + 1), at(r - 1, c));
      if (r > 1) triangles.emplace_back(at(r - 1, c), at(r, c + 1), at(r - 1, c + 1));
    }
  }
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  return mesh;
}

/// No four vertices of these are corners before others, or fewer than four are.
TEST(PatchCorners, OfPolygonsDoNotDependOnTheOrderOfVerticesEither) {
  for (const int corners : {32, 8, 6, 5, 3}) {
    for (const double degrees : {0.0, 7.0, 45.0}) {
      SCOPED_TRACE(fmt::format("{} at {}", corners, degrees));
      SurfaceMesh mesh = turned(disk(corners, 4), degrees, Eigen::Vector3d::UnitZ());
      if (corners == 3) {  // a triangle's sides must have vertices
        mesh = disk(12, 4);
        for (auto x : mesh.vertices.colwise()) {
          const double angle = std::atan2(x.y(), x.x()), third = 2 * std::numbers::pi / 3;
          x.head<2>() /= std::cos(angle - third * std::round(angle / third));
        }
        mesh = turned(mesh, degrees, Eigen::Vector3d::UnitZ());
      }
      const Eigen::Matrix2Xd map = map_patch_to_square(mesh);
      int side = 0;
      for (const auto& triangle : mesh.triangles.colwise()) {
        const Eigen::Vector2d a = map.col(triangle[1]) - map.col(triangle[0]),
                              b = map.col(triangle[2]) - map.col(triangle[0]);
        const double twice = a.x() * b.y() - a.y() * b.x();
        if (side == 0) side = twice > 0 ? 1 : -1;
        EXPECT_GT(side * twice, -1e-12);
      }
      demand_same_whatever_the_order(mesh);
    }
  }
}

}  // namespace
}  // namespace limber::rods
