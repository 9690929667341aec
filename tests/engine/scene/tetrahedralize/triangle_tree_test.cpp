#include "engine/scene/tetrahedralize/triangle_tree.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "engine/scene/formats/surface_formats.h"
#include "tests/engine/scene/tetrahedralize/box_surface.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;
using testing::box;

/// Distance to a box from its formula, negative inside.
double box_distance(const Vector3d& x, const Vector3d& low, const Vector3d& high) {
  const Vector3d q = (x - 0.5 * (low + high)).cwiseAbs() - 0.5 * (high - low);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

TriangleSurface sphere(int rings, int segments) {
  TriangleSurface surface;
  surface.vertices.resize(3, (rings - 1) * segments + 2);
  surface.vertices.col(0) = Vector3d::UnitZ();
  surface.vertices.col(1) = -Vector3d::UnitZ();
  const auto vertex = [&](int r, int s) {
    return r == 0 ? 0 : r == rings ? 1 : 2 + (r - 1) * segments + s % segments;
  };
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      const double polar = std::numbers::pi * r / rings, turn = 2 * std::numbers::pi * s / segments;
      surface.vertices.col(vertex(r, s)) << std::sin(polar) * std::cos(turn),
          std::sin(polar) * std::sin(turn), std::cos(polar);
    }
  }
  std::vector<Eigen::Vector3i> triangles;
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      if (r > 0) triangles.emplace_back(vertex(r, s), vertex(r + 1, s), vertex(r, s + 1));
      if (r + 1 < rings)
        triangles.emplace_back(vertex(r, s + 1), vertex(r + 1, s), vertex(r + 1, s + 1));
    }
  }
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    surface.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  return surface;
}

TEST(TriangleTree, SignedDistanceOfABoxIsExact) {
  const Vector3d low(-0.3, 0.1, 2), high(0.9, 0.4, 2.5);
  const TriangleSurface surface = closed_outward(box(low, high));
  const TriangleTree tree(surface);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-0.5, 1.5);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d x =
        low + Vector3d(unit(random), unit(random), unit(random)).cwiseProduct(high - low);
    EXPECT_NEAR(tree.signed_distance(x), box_distance(x, low, high), 1e-13);
  }
}

TEST(TriangleTree, WindingNumberOfASphereIsOneInsideAndZeroOutside) {
  const TriangleSurface surface = closed_outward(sphere(40, 60));
  const TriangleTree tree(surface);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.5, 1.5);
  for (int i = 0; i < 3000; ++i) {
    const Vector3d x(unit(random), unit(random), unit(random));
    if (std::abs(x.norm() - 1) < 0.01) continue;  // between the polyhedron and the sphere
    EXPECT_NEAR(tree.winding_number(x), x.norm() < 1 ? 1 : 0, 0.03);
    EXPECT_NEAR(tree.distance(x), std::abs(x.norm() - 1), 0.005);
  }
}

TEST(TriangleTree, OverlappingPartsAreUnited) {
  const TriangleSurface a = box({0, 0, 0}, {2, 1, 1}), b = box({1, 0.2, 0.2}, {3, 0.8, 0.8});
  TriangleSurface both;
  both.vertices.resize(3, 16);
  both.vertices << a.vertices, b.vertices;
  both.triangles.resize(3, 24);
  both.triangles << a.triangles, b.triangles.array() + 8;
  const TriangleTree tree(both);
  EXPECT_NEAR(tree.winding_number({1.5, 0.5, 0.5}), 2, 1e-9);
  EXPECT_LT(tree.signed_distance({0.5, 0.5, 0.5}), 0);
  EXPECT_LT(tree.signed_distance({2.5, 0.5, 0.5}), 0);
  EXPECT_GT(tree.signed_distance({2.5, 0.1, 0.5}), 0);
}

TEST(TriangleTree, DegenerateTrianglesDoNotSpoilDistances) {
  TriangleSurface surface = box({0, 0, 0}, {1, 1, 1});
  surface.triangles.conservativeResize(3, 14);
  surface.triangles.col(12) << 0, 0, 0;
  surface.triangles.col(13) << 0, 1, 1;
  const TriangleTree tree(surface);
  EXPECT_NEAR(tree.signed_distance({0.5, 0.5, -0.25}), 0.25, 1e-14);
  EXPECT_NEAR(tree.signed_distance({0.5, 0.5, 0.25}), -0.25, 1e-14);
}

}  // namespace
}  // namespace limber::scene::lattice
