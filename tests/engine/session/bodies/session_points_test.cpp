// Constraints on points of surfaces hold these where the frames show them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "engine/scene/embedding/surface_embedding.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using Eigen::Vector3d;
using scene::PointSurface;
using scene::SurfacePoint;
using spacetime::SolveStatus;
using test::held;
using test::kInfinity;
using test::kTip;
using test::Live;

/// The bar carries a triangle about its tip: one vertex inside, one in a face, one outside.
scene::Scene carrying_bar() {
  scene::Scene scene = test::bent_bar();
  auto carried = std::make_shared<scene::DetailedSurface>();
  carried->name = "tip.obj";
  carried->surface.vertices.resize(3, 3);
  carried->surface.vertices << 0.57, 0.6, 0.63,  //
      0.03, 0.07, 0.04,                          //
      0.11, 0.16, 0.21;
  carried->surface.triangles.resize(3, 1);
  carried->surface.triangles << 0, 1, 2;
  scene.surface = std::move(carried);
  scene.constraints.clear();
  return scene;
}

scene::Constraint on(int frame, const SurfacePoint& point, const Vector3d& displacement) {
  scene::Constraint constraint = held(frame, 0, displacement);
  constraint.nodes.clear();
  constraint.point = point;
  constraint.weight = kInfinity;
  return constraint;
}

/// Of the mesh's own surface, as the session gives it to clients.
Vector3d shown_on_mesh(const BodySession& session, const BodyResult& result, int frame,
                       const SurfacePoint& point) {
  const auto positions = session.positions(result, frame, 1);
  Vector3d at = Vector3d::Zero();
  for (int corner = 0; corner < 3; ++corner) {
    const int node = session.geometry()->surface(corner, point.triangle);
    at += point.weights[corner] * positions.col(0).segment<3>(3 * Eigen::Index{node});
  }
  return at;
}

/// Vertices of the carried surface, 3 x v.
Eigen::Matrix3Xd shown_vertices(const scene::Scene& scene, const BodySession& session,
                                const BodyResult& result, int frame) {
  const auto embedding =
      scene::embed_surface(scene.mesh.nodes, scene.mesh.tets, scene.surface->surface.vertices);
  const Eigen::MatrixXd moved =
      scene::embedded_positions(embedding, session.positions(result, frame, 1));
  return Eigen::Map<const Eigen::Matrix3Xd>(moved.data(), 3, moved.size() / 3);
}

/// The triangle of the bar's end face nearest to a point of it.
int triangle_of_end(const Geometry& geometry) {
  for (int t = 0; t < geometry.surface.cols(); ++t) {
    bool at_end = true;
    for (int corner = 0; corner < 3; ++corner)
      at_end = at_end && geometry.rest(0, geometry.surface(corner, t)) > 0.599;
    if (at_end) return t;
  }
  return -1;
}

constexpr double kRoundingOfFrames = 2e-7;  // of shown frames of a bar of 0.6 m

TEST(SessionPoints, OfTheMeshAreMetWhereTheFramesShowThem) {
  Live live(test::bent_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  const SurfacePoint point{triangle_of_end(*live.session.geometry()), {0.5, 0.2, 0.3}};
  scene::Constraint constraint = on(15, point, {0.61, 0.2, 0.05});
  constraint.kind = scene::TargetKind::kPosition;
  const auto result = live.edit({AddConstraint{constraint}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_TRUE(result->is_exact);
  EXPECT_LT((shown_on_mesh(live.session, *result, 15, point) - constraint.target).norm(),
            kRoundingOfFrames);
  EXPECT_LT(result->report.max_exact_error, 1e-8);
  // No node of the triangle is there.
  for (int corner = 0; corner < 3; ++corner) {
    SurfacePoint node = point;
    node.weights = Vector3d::Unit(corner);
    EXPECT_GT((shown_on_mesh(live.session, *result, 15, node) - constraint.target).norm(), 0.01);
  }
}

TEST(SessionPoints, OfTheCarriedSurfaceAreMetWhereTheFramesShowThem) {
  const scene::Scene scene = carrying_bar();
  Live live(scene);
  const SurfacePoint point{0, {0.3, 0.3, 0.4}};
  scene::Constraint vertex = held(20, 0, {0, -0.1, 0.1});
  vertex.nodes.clear();
  vertex.surface_vertex = 2;
  vertex.weight = kInfinity;
  const auto result =
      live.edit({AddConstraint{on(10, point, {0.01, 0.12, 0.03})}, AddConstraint{vertex}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  const Eigen::Matrix3Xd& rest = scene.surface->surface.vertices;
  const Eigen::Matrix3Xd at_10 = shown_vertices(scene, live.session, *result, 10);
  const Eigen::Matrix3Xd at_20 = shown_vertices(scene, live.session, *result, 20);
  EXPECT_LT(((at_10 - rest) * point.weights - Vector3d(0.01, 0.12, 0.03)).norm(),
            kRoundingOfFrames);
  EXPECT_LT((at_20.col(2) - rest.col(2) - vertex.target).norm(), kRoundingOfFrames);
}

/// gamma/2 |miss / length|^2 of the shown point, as of nodes.
TEST(SessionPoints, SoftOnesHaveTheEnergyOfTheirMiss) {
  Live live(carrying_bar());
  scene::Constraint soft = on(15, {0, {0.3, 0.3, 0.4}}, {0.02, 0.2, 0.1});
  soft.weight = 0.03;
  const auto result = live.edit({AddConstraint{soft}});
  ASSERT_TRUE(result);
  const scene::Scene scene = carrying_bar();
  const Eigen::Matrix3Xd moved = shown_vertices(scene, live.session, *result, 15);
  const Vector3d miss =
      (moved - scene.surface->surface.vertices) * soft.point->weights - soft.target;
  EXPECT_GT(miss.norm(), 0.01);
  EXPECT_NEAR(result->report.max_constraint_error, miss.norm(), 1e-5);
  const double length = live.session.model()->length;
  const double energy = 0.5 * soft.weight * (miss / length).squaredNorm();
  EXPECT_NEAR(result->report.constraint_energy, energy, 1e-3 * energy);
}

TEST(SessionPoints, VelocitiesAreThoseOfTheShownPoint) {
  const scene::Scene scene = carrying_bar();
  Live live(scene);
  scene::Constraint velocity = on(15, {0, {0.3, 0.3, 0.4}}, {0.05, 0.9, -0.4});
  velocity.kind = scene::TargetKind::kVelocity;
  const auto result = live.edit({AddConstraint{velocity}});
  ASSERT_TRUE(result);
  const Vector3d shown = (shown_vertices(scene, live.session, *result, 16) -
                          shown_vertices(scene, live.session, *result, 14)) *
                         velocity.point->weights * 15;
  EXPECT_LT((shown - velocity.target).norm(), 2e-5);
  EXPECT_LT(result->report.max_exact_velocity_error, 1e-8);
}

/// A corner of a triangle is its node, to the last digit.
TEST(SessionPoints, ACornerIsItsNode) {
  Live by_node(test::bent_bar()), by_point(test::bent_bar());
  ASSERT_TRUE(by_node.recorder->wait_final(0));
  const auto geometry = by_node.session.geometry();
  const int triangle = triangle_of_end(*geometry);
  scene::Constraint node = held(15, geometry->surface(1, triangle), {0, 0.1, 0});
  scene::Constraint point = held(15, 0, {0, 0.1, 0});
  point.nodes.clear();
  point.point = SurfacePoint{triangle, {0, 1, 0}};
  ASSERT_TRUE(by_point.recorder->wait_final(0));
  const auto a = by_node.edit({AddConstraint{node}}), b = by_point.edit({AddConstraint{point}});
  EXPECT_EQ(a->report.total_energy, b->report.total_energy);
  EXPECT_EQ(a->modal, b->modal);
}

TEST(SessionPoints, AreMovedReplacedUndoneAndSavedAsNamed) {
  const scene::Scene scene = carrying_bar();
  Live live(scene);
  const SurfacePoint point{0, {0.3, 0.3, 0.4}, PointSurface::kCarried};
  const auto at = [&](const BodyResult& result) -> Vector3d {
    return (shown_vertices(scene, live.session, result, 10) - scene.surface->surface.vertices) *
           point.weights;
  };
  const Vector3d first(0.01, 0.12, 0.03), second(0, 0.05, 0.1);
  live.edit({AddConstraint{on(10, point, first)}});
  EXPECT_LT((at(*live.edit({MoveConstraint{1, second}})) - second).norm(), kRoundingOfFrames);
  scene::Constraint nodes = held(10, kTip, {0, 0.02, 0});
  nodes.id = 1;
  const auto replaced = live.edit({ReplaceConstraint{nodes}});
  EXPECT_GT((at(*replaced) - second).norm(), 0.01);
  EXPECT_LT((at(*live.edit({Undo{}})) - second).norm(), kRoundingOfFrames);
  EXPECT_LT((at(*live.edit({Undo{}})) - first).norm(), kRoundingOfFrames);
  EXPECT_LT((at(*live.edit({Redo{}})) - second).norm(), kRoundingOfFrames);

  const scene::Scene saved = live.session.scene();
  ASSERT_EQ(saved.constraints.size(), 1u);
  EXPECT_TRUE(saved.constraints[0].nodes.empty());
  ASSERT_TRUE(saved.constraints[0].point);
  EXPECT_EQ(saved.constraints[0].point->weights, point.weights);
  EXPECT_EQ(saved.constraints[0].point->surface, PointSurface::kCarried);
  Live again(saved);
  const auto reopened = again.recorder->wait_final(0);
  EXPECT_LT((shown_vertices(scene, again.session, *reopened, 10) * point.weights -
             scene.surface->surface.vertices * point.weights - second)
                .norm(),
            kRoundingOfFrames);
}

TEST(SessionPoints, WhereAllTheirNodesAreFixedAWarningSaysSo) {
  Live live(test::bent_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  const auto geometry = live.session.geometry();
  int triangle = 0;
  const auto is_held = [&](int t) {
    for (int corner = 0; corner < 3; ++corner)
      if (geometry->rest(0, geometry->surface(corner, t)) > 1e-6) return false;
    return true;
  };
  while (!is_held(triangle)) ++triangle;
  const auto receipt =
      live.session.edit({AddConstraint{on(5, {triangle, {0.2, 0.3, 0.5}}, {0, 0.1, 0})}});
  ASSERT_EQ(receipt.issues.size(), 1u);
  EXPECT_EQ(receipt.issues[0].field, "edits[0].add.constraint.point");
}

}  // namespace
}  // namespace limber::session
