#include "engine/scene/embedding/surface_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "engine/base/error.h"
#include "engine/scene/embedding/surface_embedding.h"
#include "engine/scene/samples/samples.h"

namespace limber::scene {
namespace {

using Eigen::Vector3d;

Vector3d mean_of(const NodeMean& mean, const Eigen::Matrix3Xd& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < mean.nodes.size(); ++i) {
    sum += nodes.col(mean.nodes[i]) *
           (mean.weights.empty() ? 1.0 / static_cast<double>(mean.nodes.size()) : mean.weights[i]);
  }
  return sum;
}

Constraint on(int triangle, const Vector3d& weights, PointSurface surface) {
  Constraint constraint;
  constraint.point = SurfacePoint{triangle, weights, surface};
  return constraint;
}

Constraint at_vertex(int vertex) {
  Constraint constraint;
  constraint.surface_vertex = vertex;
  return constraint;
}

/// A flower that carries two triangles, one vertex of which is far outside.
Scene with_surface() {
  Scene scene = make_sample("flower");
  auto carried = std::make_shared<DetailedSurface>();
  carried->name = "two.obj";
  const Eigen::Matrix3Xd& nodes = scene.mesh.nodes;
  const Vector3d low = nodes.rowwise().minCoeff(), size = nodes.rowwise().maxCoeff() - low;
  carried->surface.vertices.resize(3, 4);
  carried->surface.vertices << nodes.col(10), nodes.col(700) + 0.01 * size,
      nodes.col(40) - 0.02 * size, low - 0.3 * size;
  carried->surface.triangles.resize(3, 2);
  carried->surface.triangles << 0, 1,  //
      1, 3,                            //
      2, 2;
  scene.surface = std::move(carried);
  return scene;
}

TEST(SurfacePoints, AreMeansOfTheCornersOfTheMesh) {
  const Scene scene = make_sample("bird");
  const SurfacePoints points(scene);
  const NodeMean mean = points.nodes_of(on(7, {0.5, 0.2, 0.3}, PointSurface::kShown));
  EXPECT_THAT(mean.weights, ::testing::ElementsAre(0.5, 0.2, 0.3));
  const NodeMean corner = points.nodes_of(on(7, {0, 1, 0}, PointSurface::kMesh));
  EXPECT_EQ(corner.nodes, mean.nodes);
  EXPECT_THAT(corner.weights, ::testing::ElementsAre(0, 1, 0));
}

TEST(SurfacePoints, OfTheCarriedSurfaceMoveAsItsEmbeddingSays) {
  const Scene scene = with_surface();
  const SurfacePoints points(scene);
  const auto& surface = scene.surface->surface;
  const SurfaceEmbedding embedding =
      embed_surface(scene.mesh.nodes, scene.mesh.tets, surface.vertices);
  ASSERT_GT(embedding.outside_count, 0);
  const Eigen::Matrix3Xd moved =
      scene.mesh.nodes + 0.1 * scene.mesh.nodes.array().square().matrix();
  Eigen::Matrix3Xd shown(3, 4);
  for (int v = 0; v < 4; ++v) {
    shown.col(v).setZero();
    for (int c = 0; c < 4; ++c)
      shown.col(v) += embedding.weights(c, v) * moved.col(embedding.nodes(c, v));
    EXPECT_EQ(mean_of(points.nodes_of(at_vertex(v)), moved), shown.col(v)) << v;
    EXPECT_LT(
        (mean_of(points.nodes_of(at_vertex(v)), scene.mesh.nodes) - surface.vertices.col(v)).norm(),
        1e-12 * scene.mesh.nodes.norm());
  }
  for (const PointSurface kind : {PointSurface::kShown, PointSurface::kCarried}) {
    const Vector3d weights(0.2, 0.5, 0.3);
    const Vector3d at = mean_of(points.nodes_of(on(1, weights, kind)), moved);
    const Vector3d expected = shown(Eigen::all, surface.triangles.col(1)) * weights;
    EXPECT_LT((at - expected).norm(), 1e-13 * expected.norm());
  }
}

TEST(SurfacePoints, WeightsAreDividedByTheirSum) {
  const Scene scene = with_surface();
  const SurfacePoints points(scene);
  for (const PointSurface kind : {PointSurface::kMesh, PointSurface::kCarried}) {
    const Constraint constraint = on(0, {0.25 + 4e-7, 0.25, 0.5}, kind);
    EXPECT_NO_THROW(points.check(constraint));
    double sum = 0;
    for (const double weight : points.nodes_of(constraint).weights) sum += weight;
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

/// Faces between merged duplicates are inside; tets that are inside out are turned.
TEST(SurfacePoints, TheSurfaceOfTheMeshIsThatOfThePreparedOne) {
  Scene scene;
  scene.frame_count = 10;
  scene.merge_tolerance = 1e-6;
  scene.mesh.nodes.resize(3, 8);
  scene.mesh.nodes << 0, 1, 0, 0, 1, 0, 0, 1,  //
      0, 0, 1, 0, 0, 1, 0, 1,                  //
      0, 0, 0, 1, 0, 0, 1, 1;
  scene.mesh.tets.resize(4, 2);
  scene.mesh.tets << 0, 4,  //
      1, 5,                 //
      2, 6,                 //
      3, 7;
  const SurfacePoints points(scene);
  EXPECT_NO_THROW(points.check(on(5, {1, 0, 0}, PointSurface::kMesh)));
  EXPECT_THROW(points.check(on(6, {1, 0, 0}, PointSurface::kMesh)), Error);
  for (int t = 0; t < 6; ++t) {
    const auto nodes = points.nodes_of(on(t, {1, 0, 0}, PointSurface::kMesh)).nodes;
    const Vector3d a = scene.mesh.nodes.col(nodes[0]), b = scene.mesh.nodes.col(nodes[1]),
                   c = scene.mesh.nodes.col(nodes[2]);
    // Seen from the middle of the body every triangle is counter-clockwise from outside.
    EXPECT_GT((b - a).cross(c - a).dot((a + b + c) / 3 - Vector3d::Constant(0.4)), 0) << t;
  }
}

TEST(SurfacePoints, OfABadMeshAreNotChecked) {
  Scene scene = make_sample("bird");
  scene.mesh.tets(0, 3) = -1;
  const SurfacePoints points(scene);
  EXPECT_FALSE(points.can_check(on(0, {1, 0, 0}, PointSurface::kMesh)));
  EXPECT_TRUE(points.can_check(at_vertex(0)));
  EXPECT_THROW(points.check(on(0, {1, 0, 0}, PointSurface::kMesh)), Error);
}

TEST(SurfacePoints, OfFixedNodesAloneAreSaidToBeIdle) {
  const NodeMean mean{{1, 2, 3}, {0.5, 0.5, 0}};
  EXPECT_TRUE(is_fixed(mean, [](int node) { return node < 3; }));
  EXPECT_FALSE(is_fixed(mean, [](int node) { return node < 2; }));
  EXPECT_FALSE(is_fixed({{1, 3}, {}}, [](int node) { return node < 3; }));
}

TEST(SurfacePoints, ScenesWithThemAreValidated) {
  Scene scene = with_surface();
  scene.constraints.resize(2);
  for (Constraint& constraint : scene.constraints) constraint.nodes.clear();
  scene.constraints[0].point = SurfacePoint{1, {0.2, 0.5, 0.3}};
  scene.constraints[1].surface_vertex = 1;
  EXPECT_THAT(validate(scene), ::testing::IsEmpty());
  scene.constraints[0].point->triangle = 2;
  scene.constraints[1].surface_vertex = 4;
  const auto issues = validate(scene);
  ASSERT_EQ(issues.size(), 2u);
  EXPECT_EQ(issues[0].field, "constraints[0].point.triangle");
  EXPECT_EQ(issues[1].field, "constraints[1].surface_vertex");
  EXPECT_EQ(issues[1].code, ErrorCode::kOutOfRange);
}

}  // namespace
}  // namespace limber::scene
