#include "engine/rods/design/mesh_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/rods/design/placed_surface.h"
#include "engine/rods/design/triangle_projection.h"
#include "engine/scene/formats/surface_formats.h"
#include "tests/engine/rods/design/small_patches.h"

namespace limber::rods {
namespace {

/// A height field over n x n cells of size 1.
SurfaceMesh hills(int n, double height) {
  return testing::cells(n, [&](int i, int j) {
    return Eigen::Vector3d(i, j, height * std::sin(0.7 * i) * std::cos(0.5 * j));
  });
}

/// Three triangles of a cube's corner at the origin, seen from outside: convex.
SurfaceMesh corner() {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1;
  mesh.triangles.resize(3, 3);
  mesh.triangles << 0, 0, 0, 1, 2, 3, 2, 3, 1;
  return mesh;
}

Eigen::Vector3d random_point(Random& random, double low, double high) {
  return {random.uniform(low, high), random.uniform(low, high), random.uniform(low, high)};
}

std::string refused_mesh(const SurfaceMesh& mesh) {
  try {
    const MeshSurface surface(mesh);
  } catch (const Error& error) {
    return error.field();
  }
  return "none";
}

TEST(MeshSurface, FindsWhatASearchThroughAllTrianglesFinds) {
  for (const int n : {1, 2, 9}) {
    const SurfaceMesh mesh = hills(n, 1.5);
    const MeshSurface surface(mesh);
    Random random(3);
    for (int k = 0; k < 2000; ++k) {
      const Eigen::Vector3d x = random_point(random, -4, 13);
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
        const Eigen::Vector3d p = project_onto_triangle(corners(mesh, t), x).position;
        least = std::min(least, (x - p).norm());
      }
      EXPECT_NEAR((x - surface.closest(x).position).norm(), least, 1e-14 * (1 + least));
    }
  }
}

TEST(MeshSurface, NoSampleOfATriangleIsNearer) {
  Random random(8);
  for (int k = 0; k < 500; ++k) {
    Eigen::Matrix3d triangle;
    for (int c = 0; c < 3; ++c) triangle.col(c) = random_point(random, -1, 1);
    const Eigen::Vector3d x = random_point(random, -2, 2);
    const Eigen::Vector3d p = project_onto_triangle(triangle, x).position;
    const Eigen::Vector3d shares = triangle.inverse() * p;
    EXPECT_NEAR(shares.sum(), 1, 1e-6);
    EXPECT_GE(shares.minCoeff(), -1e-6);
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; i + j <= 20; ++j) {
        const Eigen::Vector3d sample =
            triangle * Eigen::Vector3d(i / 20.0, j / 20.0, (20 - i - j) / 20.0);
        EXPECT_GE((x - sample).norm(), (x - p).norm() - 1e-12);
      }
    }
  }
}

TEST(MeshSurface, TheDerivativeAgreesWithDifferences) {
  const MeshSurface surface(hills(5, 1.5));
  Random random(5);
  int ranks[3] = {0, 0, 0};
  for (int k = 0; k < 600; ++k) {
    const Eigen::Vector3d x = random_point(random, -3, 8);
    const ClosestPoint here = surface.closest(x);
    EXPECT_LT((here.derivative - here.derivative.transpose()).norm(), 1e-14);
    constexpr double kStep = 1e-6;
    Eigen::Matrix3d difference;
    bool same = true;  // all on one face, edge or vertex
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const ClosestPoint ahead = surface.closest(x + step), behind = surface.closest(x - step);
      same = same && (ahead.derivative - here.derivative).norm() < 1e-12 &&
             (behind.derivative - here.derivative).norm() < 1e-12;
      difference.col(axis) = (ahead.position - behind.position) / (2 * kStep);
    }
    if (!same) continue;
    EXPECT_LT((difference - here.derivative).norm(), 1e-7);
    const int rank = static_cast<int>(std::lround(here.derivative.trace()));
    ++ranks[rank];
  }
  for (const int count : ranks) EXPECT_GT(count, 10);  // vertices, edges, faces
}

TEST(MeshSurface, ClosestPointsOnTheRimAndAtVertices) {
  const MeshSurface flat(hills(4, 0));
  const ClosestPoint beside = flat.closest({-1, 1.3, 2});
  EXPECT_LT((beside.position - Eigen::Vector3d(0, 1.3, 0)).norm(), 1e-15);
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  EXPECT_LT((beside.derivative - y * y.transpose()).norm(), 1e-15);
  const ClosestPoint beyond = flat.closest({-1, -2, 0.5});
  EXPECT_EQ(beyond.position, Eigen::Vector3d::Zero());
  EXPECT_EQ(beyond.derivative, Eigen::Matrix3d::Zero());
  // In the plane, beyond the rim's corner of which only one triangle has it.
  EXPECT_EQ(flat.closest({5, -1, 0}).position, Eigen::Vector3d(4, 0, 0));

  const MeshSurface convex(corner());
  EXPECT_EQ(convex.closest({0.4, 0.2, 0.1}).position, Eigen::Vector3d::Zero());
  EXPECT_EQ(convex.closest({0.4, 0.2, 0.1}).derivative, Eigen::Matrix3d::Zero());
  const ClosestPoint ridge = convex.closest({-0.3, 0.2, 0.5});
  EXPECT_LT((ridge.position - Eigen::Vector3d(-0.3, 0, 0)).norm(), 1e-15);
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_LT((ridge.derivative - x * x.transpose()).norm(), 1e-15);
}

TEST(MeshSurface, PointsOfTheSurfaceAreTheirOwnClosestPoints) {
  const SurfaceMesh mesh = hills(6, 1.5);
  const MeshSurface surface(mesh);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    EXPECT_EQ(surface.closest(mesh.vertices.col(v)).position, mesh.vertices.col(v));
  Random random(2);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Matrix3d triangle = corners(mesh, t);
    for (int k = 0; k < 3; ++k) {
      const double share = random.uniform(0, 1);
      const Eigen::Vector3d x =
          triangle.col(k) + share * (triangle.col((k + 1) % 3) - triangle.col(k));
      EXPECT_LT((surface.closest(x).position - x).norm(), 1e-14);
    }
  }
}

TEST(MeshSurface, WhatIsNoManifoldIsAllRightForDistances) {
  SurfaceMesh mesh = corner();  // three triangles that share the edge 0 1, one of them turned over
  mesh.triangles << 0, 1, 0, 1, 0, 1, 2, 3, 3;
  const MeshSurface surface(mesh);
  EXPECT_LT((surface.closest({-0.5, 1, 1}).position - Eigen::Vector3d(-0.5, 0, 0)).norm(), 1e-15);
}

TEST(MeshSurface, TrianglesWithoutAreaArePassedOver) {
  SurfaceMesh mesh = corner();
  mesh.triangles.conservativeResize(3, 5);
  mesh.triangles.col(3) << 1, 1, 2;
  mesh.triangles.col(4) << 0, 0, 0;
  const MeshSurface surface(mesh), without(corner());
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d x = random_point(random, -2, 1);
    EXPECT_EQ(surface.closest(x).position, without.closest(x).position);
  }
}

TEST(MeshSurface, IsTheSameFromEveryFormat) {
  const char* const obj = "v 0 0 0\nv 2 0 0\nv 2 1 1\nv 0 1 1\nf 1 2 3 4\n";
  const char* const ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n2 0 0\n2 1 1\n0 1 1\n3 0 1 2\n3 0 2 3\n";
  const char* const stl =
      "solid s\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 2 1 1\n"
      "endloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 1 1\n"
      "vertex 0 1 1\nendloop\nendfacet\nendsolid s\n";
  const auto open = [](const std::string& name, const char* content) {
    const scene::TriangleSurface read = scene::read_surface(name, content);
    return std::make_unique<MeshSurface>(SurfaceMesh{read.vertices, read.triangles});
  };
  const auto from_obj = open("s.obj", obj), from_ply = open("s.ply", ply),
             from_stl = open("s.stl", stl);
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d x = random_point(random, -2, 4);
    const ClosestPoint expected = from_obj->closest(x);
    for (const MeshSurface* other : {from_ply.get(), from_stl.get()}) {
      EXPECT_LT((other->closest(x).position - expected.position).norm(), 1e-14);
      EXPECT_LT((other->closest(x).derivative - expected.derivative).norm(), 1e-14);
    }
  }
}

TEST(MeshSurface, BadInputIsNamed) {
  EXPECT_EQ(refused_mesh({}), "surface.triangles");
  SurfaceMesh mesh = corner();
  mesh.vertices(1, 2) = std::nan("");
  EXPECT_EQ(refused_mesh(mesh), "surface.vertices[2]");
  mesh = corner();
  mesh.triangles(0, 1) = 4;
  EXPECT_EQ(refused_mesh(mesh), "surface.triangles[1]");
  mesh = corner();
  mesh.triangles.setZero();
  EXPECT_EQ(refused_mesh(mesh), "surface.triangles");
  EXPECT_EQ(refused_mesh(corner()), "none");
}

TEST(PlacedSurface, IsTheSurfaceWithItsVerticesMoved) {
  const SurfaceMesh mesh = hills(4, 1.5);
  const SurfacePlacement placement{Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2), {3, -2, 5}, 2.5};
  SurfaceMesh moved = mesh;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    moved.vertices.col(v) =
        placement.translation + 2.5 * (placement.rotation.normalized() * mesh.vertices.col(v));
  const PlacedSurface placed(std::make_shared<MeshSurface>(mesh), placement);
  const MeshSurface expected(moved);
  Random random(4);
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d x = random_point(random, -12, 15);
    const ClosestPoint a = placed.closest(x), b = expected.closest(x);
    EXPECT_LT((a.position - b.position).norm(), 1e-12);
    EXPECT_LT((a.derivative - b.derivative).norm(), 1e-12);
  }
}

TEST(PlacedSurface, BadPlacementsAreNamed) {
  const auto field = [](const SurfacePlacement& placement) -> std::string {
    try {
      placement.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(field({.scale = 0}), "scale");
  EXPECT_EQ(field({.scale = std::nan("")}), "scale");
  EXPECT_EQ(field({.translation = {0, INFINITY, 0}}), "translation");
  EXPECT_EQ(field({.rotation = Eigen::Quaterniond(0, 0, 0, 0)}), "rotation");
  EXPECT_EQ(field({}), "none");
}

}  // namespace
}  // namespace limber::rods
