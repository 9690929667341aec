#include "engine/scene/embedding/surface_embedding.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/base/parallel.h"
#include "engine/scene/samples/samples.h"

namespace limber::scene {
namespace {

using Eigen::Vector3d;

/// Random points in the box around a mesh, made larger by a factor.
Eigen::Matrix3Xd points_around(const bodies::TetMesh& mesh, int count, double factor) {
  const Vector3d low = mesh.nodes.rowwise().minCoeff(), high = mesh.nodes.rowwise().maxCoeff();
  const Vector3d middle = 0.5 * (low + high);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-0.5, 0.5);
  return Eigen::Matrix3Xd::NullaryExpr(3, count, [&](Eigen::Index axis, Eigen::Index) {
    return middle(axis) + factor * share(random) * (high(axis) - low(axis));
  });
}

Eigen::MatrixXd column_of(const Eigen::Matrix3Xd& nodes) {
  return Eigen::Map<const Eigen::VectorXd>(nodes.data(), nodes.size());
}

TEST(SurfaceEmbedding, RestPositionsAreMetInsideAndOutside) {
  for (const char* name : {"flower", "bird"}) {
    const bodies::TetMesh mesh = make_sample(name).mesh;
    const Eigen::Matrix3Xd vertices = points_around(mesh, 500, 1.2);
    const SurfaceEmbedding embedding = embed_surface(mesh.nodes, mesh.tets, vertices);
    ASSERT_EQ(embedding.vertex_count(), 500);
    EXPECT_GT(embedding.outside_count, 0) << name;
    EXPECT_LT(embedding.outside_count, 500) << name;
    EXPECT_LT((embedding.weights.colwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
    const Eigen::MatrixXd moved = embedded_positions(embedding, column_of(mesh.nodes));
    const double extent =
        (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
    EXPECT_LT((moved.cast<double>() - column_of(vertices)).cwiseAbs().maxCoeff(), 1e-6 * extent)
        << name;
  }
}

TEST(SurfaceEmbedding, VerticesFollowAffineMotionsExactly) {
  const bodies::TetMesh mesh = make_sample("flower").mesh;
  const Eigen::Matrix3Xd vertices = points_around(mesh, 300, 1.1);
  const SurfaceEmbedding embedding = embed_surface(mesh.nodes, mesh.tets, vertices);
  Eigen::Matrix3d map;
  map << 0.3, -1.2, 0.1, 1.1, 0.2, 0.4, -0.2, 0.3, 1.3;
  const Vector3d shift(3, -1, 2);
  Eigen::MatrixXd motion(mesh.nodes.size(), 2);
  motion.col(0) = column_of((map * mesh.nodes).colwise() + shift);
  motion.col(1) = column_of(mesh.nodes);
  const Eigen::MatrixXd moved = embedded_positions(embedding, motion);
  const Eigen::MatrixXd expected = column_of((map * vertices).colwise() + shift);
  EXPECT_LT((moved.col(0).cast<double>() - expected).cwiseAbs().maxCoeff(),
            1e-6 * expected.cwiseAbs().maxCoeff());
}

/// A search over all tets.
int holder_of(const bodies::TetMesh& mesh, const Vector3d& x) {
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    Eigen::Matrix4d corners;
    for (int c = 0; c < 4; ++c) corners.col(c) << mesh.nodes.col(mesh.tets(c, t)), 1;
    const Eigen::Vector4d weights = corners.fullPivLu().solve(x.homogeneous());
    if (weights.minCoeff() >= 0) return static_cast<int>(t);
  }
  return -1;
}

TEST(SurfaceEmbedding, TheTetThatHoldsAVertexIsFound) {
  const bodies::TetMesh mesh = make_sample("bird").mesh;
  const Eigen::Matrix3Xd vertices = points_around(mesh, 100, 1);
  const SurfaceEmbedding embedding = embed_surface(mesh.nodes, mesh.tets, vertices);
  int outside = 0;
  for (int v = 0; v < embedding.vertex_count(); ++v) {
    const bool inside = holder_of(mesh, vertices.col(v)) >= 0;
    outside += inside ? 0 : 1;
    EXPECT_EQ(embedding.weights.col(v).minCoeff() >= -1e-12, inside) << v;
  }
  EXPECT_EQ(embedding.outside_count, outside);
  EXPECT_GT(outside, 0);
}

TEST(SurfaceEmbedding, OutsideTheNearestTetIsFollowedAndItsDistanceIsKnown) {
  Eigen::Matrix3Xd nodes(3, 8);
  nodes << 0, 1, 0, 0, 10, 11, 10, 10,  //
      0, 0, 1, 0, 0, 0, 1, 0,           //
      0, 0, 0, 1, 0, 0, 0, 1;
  bodies::TetNodes tets(4, 2);
  tets << 0, 4, 1, 5, 2, 6, 3, 7;
  Eigen::Matrix3Xd vertices(3, 3);
  vertices << 10.2, 0.1, 3, 0.1, 0.1, 0, 0.1, 0.1, -0.5;
  const SurfaceEmbedding embedding = embed_surface(nodes, tets, vertices);
  EXPECT_EQ(embedding.nodes(0, 0), 4);
  EXPECT_EQ(embedding.nodes(0, 1), 0);
  EXPECT_EQ(embedding.nodes(0, 2), 0);
  EXPECT_EQ(embedding.outside_count, 1);
  EXPECT_NEAR(embedding.outside_distance, std::hypot(2, 0.5), 1e-12);
  EXPECT_NE(embedding_warning(embedding, 11).find("1 of its 3 vertices"), std::string::npos);
  EXPECT_EQ(embedding_warning(embedding, 1000), "");
}

TEST(SurfaceEmbedding, DoesNotDependOnTheNumberOfThreads) {
  const bodies::TetMesh mesh = make_sample("flower").mesh;
  const Eigen::Matrix3Xd vertices = points_around(mesh, 2000, 1.1);
  const int threads = thread_count();
  set_thread_count(1);
  const SurfaceEmbedding one = embed_surface(mesh.nodes, mesh.tets, vertices);
  set_thread_count(4);
  const SurfaceEmbedding four = embed_surface(mesh.nodes, mesh.tets, vertices);
  set_thread_count(threads);
  EXPECT_EQ(one.nodes, four.nodes);
  EXPECT_EQ(one.weights, four.weights);
}

}  // namespace
}  // namespace limber::scene
