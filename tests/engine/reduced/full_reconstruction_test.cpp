#include "engine/reduced/full_reconstruction.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"
#include "tests/support/dense.h"

namespace limber::reduced {
namespace {

Eigen::VectorXd random_vector(Eigen::Index size, double scale, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd result(size);
  for (Eigen::Index i = 0; i < size; ++i) result[i] = scale * random.normal();
  return result;
}

Eigen::Vector3d centre_of_mass_shift(const bodies::ElasticBody& body, const Eigen::VectorXd& u) {
  const Eigen::VectorXd mass = bodies::lumped_node_mass(body.mesh);
  return testing::by_node(u) * mass / mass.sum();
}

// Gradients that no displacement has: the nearest ones, by dense normal equations.
TEST(FullReconstruction, IsTheWeightedLeastSquaresSolution) {
  const bodies::ElasticBody body = testing::block(3, 2, 2, 0.1, true);
  const FullReconstruction full(body);
  const Eigen::VectorXd g = random_vector(9 * body.mesh.tet_count(), 1, 1);
  Eigen::VectorXd weight(g.size());
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    const int e = static_cast<int>(i / 9);
    Eigen::Matrix3d edges;
    for (int a = 0; a < 3; ++a) {
      edges.col(a) =
          body.mesh.nodes.col(body.mesh.tets(a + 1, e)) - body.mesh.nodes.col(body.mesh.tets(0, e));
    }
    weight[i] = std::sqrt(edges.determinant() / 6);
  }
  const Eigen::MatrixXd all = full.gradient().matrix();
  std::vector<int> columns;
  for (int i = 0; i < all.cols(); ++i) {
    if (body.mesh.nodes(0, i / 3) > 0) columns.push_back(i);
  }
  const Eigen::MatrixXd weighted = weight.asDiagonal() * all(Eigen::all, columns);
  const Eigen::VectorXd solution =
      reference::ThinQr(weighted).least_squares(weight.cwiseProduct(g));
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(all.cols());
  expected(columns) = solution;
  EXPECT_LT((full.from_gradients(g) - expected).norm(), 1e-11 * expected.norm());
}

TEST(FullReconstruction, GivesBackDisplacementsOfAHeldBody) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  for (const double size : {1e-8, 1e-3, 0.1, 0.3}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Eigen::VectorXd u = testing::smooth_field(body, size, seed);
      const Eigen::VectorXd back = full.from_coordinates(inverse.coordinates(u));
      // Digits of u below those of the identity it is added to are lost: 1e-15 per gradient.
      EXPECT_LT((back - u).norm(), 1e-10 * u.norm() + 1e-14) << size << " " << seed;
      for (int node : body.fixed_nodes) EXPECT_EQ(0, back.segment<3>(3 * node).norm());
    }
  }
}

TEST(FullReconstruction, GivesBackDisplacementsOfAFreeBodyButForTheirTranslation) {
  const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, false);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(2.9, random_vector(3, 1, seed).normalized()).toRotationMatrix();
    const Eigen::VectorXd u = testing::moved(body, testing::smooth_field(body, 0.2, seed), turn,
                                             Eigen::Vector3d(5, -3, 2));
    const Eigen::VectorXd back = full.from_coordinates(inverse.coordinates(u));
    EXPECT_LT(centre_of_mass_shift(body, back).norm(), 1e-12);
    const Eigen::Matrix3Xd centred = testing::by_node(u).colwise() - centre_of_mass_shift(body, u);
    EXPECT_LT((testing::by_node(back) - centred).norm(), 1e-10 * centred.norm()) << seed;
  }
}

// y -> u commutes with rigid motions: exp(theta) of all tets multiplied by a rotation from the
// left.
TEST(FullReconstruction, TurnsWithItsGradients) {
  const bodies::ElasticBody body = testing::block(5, 3, 2, 0.1, false);
  const FullReconstruction full(body);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.7, Eigen::Vector3d(2, 1, -1).normalized()).toRotationMatrix();
  const Eigen::VectorXd g = random_vector(9 * body.mesh.tet_count(), 0.4, 3);
  Eigen::VectorXd turned(g.size());
  for (Eigen::Index at = 0; at < g.size(); at += 9) {
    const Eigen::Map<const Eigen::Matrix3d> h(g.data() + at);
    Eigen::Map<Eigen::Matrix3d>(turned.data() + at) =
        turn * (h + Eigen::Matrix3d::Identity()) - Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix3Xd expected =
      turn * (body.mesh.nodes + testing::by_node(full.from_gradients(g))) - body.mesh.nodes;
  const Eigen::VectorXd mass = bodies::lumped_node_mass(body.mesh);
  expected.colwise() -= (expected * mass / mass.sum()).eval();
  EXPECT_LT((testing::by_node(full.from_gradients(turned)) - expected).norm(),
            1e-11 * expected.norm());
}

TEST(FullReconstruction, LinearPosesGoThroughTheirCoordinates) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, held);
    const FullReconstruction full(body);
    Eigen::MatrixXd v(3 * body.mesh.node_count(), 11);  // more than one group, the last one partial
    for (int k = 0; k < v.cols(); ++k) v.col(k) = testing::smooth_field(body, 0.5, 20 + k);
    const Eigen::MatrixXd batch = full.from_linear(v);
    const Eigen::MatrixXd plain = full.from_coordinates(linear_coordinates(full.gradient(), v));
    for (int k = 0; k < v.cols(); ++k) {
      Eigen::VectorXd expected = plain.col(k);
      if (!held) {
        const Eigen::Vector3d shift = centre_of_mass_shift(body, v.col(k));
        for (int i = 0; i < body.mesh.node_count(); ++i) expected.segment<3>(3 * i) += shift;
      }
      EXPECT_LT((batch.col(k) - expected).norm(), 1e-12 * expected.norm()) << held << " " << k;
      Eigen::VectorXd single;
      full.from_linear(v.col(k), single);
      EXPECT_LT((single - expected).norm(), 1e-12 * expected.norm()) << held << " " << k;
    }
    EXPECT_EQ(0, full.from_linear(v.leftCols(0)).cols());
  }
}

TEST(FullReconstruction, SmallLinearPosesStayWhatTheyAre) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  const FullReconstruction full(body);
  const Eigen::VectorXd field = testing::smooth_field(body, 1, 31);
  double last = 0;
  for (const double size : {1e-2, 1e-3, 1e-4, 1e-5}) {
    Eigen::VectorXd u;
    full.from_linear(size * field, u);
    const double miss = (u - size * field).norm() / (size * field.norm());
    if (last > 0) {
      EXPECT_NEAR(last / miss, 10, 1);  // of second order
    }
    last = miss;
  }
  EXPECT_LT(last, 1e-4);
}

TEST(FullReconstruction, DoesNotDependOnTheThreadsOrTheNeighboursInABatch) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const FullReconstruction full(body);
  Eigen::MatrixXd v(3 * body.mesh.node_count(), 37);
  for (int k = 0; k < v.cols(); ++k) v.col(k) = testing::smooth_field(body, 0.4, 40 + k);
  const Eigen::MatrixXd y = linear_coordinates(full.gradient(), v);
  const int before = thread_count();
  set_thread_count(1);
  const Eigen::MatrixXd one = full.from_linear(v), one_y = full.from_coordinates(y);
  set_thread_count(4);
  const Eigen::MatrixXd four = full.from_linear(v), four_y = full.from_coordinates(y);
  set_thread_count(before);
  EXPECT_EQ(one, four);
  EXPECT_EQ(one_y, four_y);
  EXPECT_LT((full.from_linear(v.middleCols(5, 3)) - one.middleCols(5, 3)).norm(),
            1e-13 * one.norm());
}

TEST(FullReconstruction, StopsWhenCancelled) {
  const bodies::ElasticBody body = testing::block(3, 2, 2, 0.1, true);
  const FullReconstruction full(body);
  JobContext job;
  job.cancellation.request();
  try {
    (void)full.from_linear(Eigen::MatrixXd::Zero(3 * body.mesh.node_count(), 20), job);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::kCancelled, error.code());
  }
}

}  // namespace
}  // namespace limber::reduced
