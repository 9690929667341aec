#include "engine/bodies/boundary_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

TEST(BoundarySurface, OfABoxIsClosedOutwardAndOfTheRightArea) {
  const TetMesh mesh = testing::box_mesh({3, 4, 2}, {2, 1, 3});
  const SurfaceTriangles surface = boundary_surface(mesh.tets);
  EXPECT_EQ(surface.cols(), 2 * 2 * (3 * 4 + 4 * 2 + 2 * 3));
  double area = 0, volume = 0;
  Eigen::Vector3d closing = Eigen::Vector3d::Zero();
  for (int t = 0; t < surface.cols(); ++t) {
    const Eigen::Vector3d a = mesh.nodes.col(surface(0, t));
    const Eigen::Vector3d b = mesh.nodes.col(surface(1, t));
    const Eigen::Vector3d c = mesh.nodes.col(surface(2, t));
    const Eigen::Vector3d normal = (b - a).cross(c - a) / 2;
    area += normal.norm();
    closing += normal;
    volume += a.dot(normal) / 3;
    EXPECT_GT(normal.dot((a + b + c) / 3 - Eigen::Vector3d(1, 0.5, 1.5)), 0) << "triangle " << t;
  }
  EXPECT_NEAR(area, 2 * (2 * 1 + 1 * 3 + 3 * 2), 1e-12);
  EXPECT_NEAR(volume, 6, 1e-12);
  EXPECT_LT(closing.norm(), 1e-13);
}

TEST(BoundarySurface, OfOneTetHasFourOutwardFaces) {
  TetNodes tets(4, 1);
  tets << 10, 20, 30, 40;
  const SurfaceTriangles surface = boundary_surface(tets);
  ASSERT_EQ(surface.cols(), 4);
  EXPECT_EQ(surface.col(0), Eigen::Vector3i(20, 30, 40));
  EXPECT_EQ(boundary_surface(TetNodes(4, 0)).cols(), 0);
}

}  // namespace
}  // namespace limber::bodies
