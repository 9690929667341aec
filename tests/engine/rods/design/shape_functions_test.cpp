#include "engine/rods/design/shape_functions.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

class NearestPlane : public ::testing::Test {
 protected:
  [[nodiscard]] Eigen::VectorXd increment(unsigned seed, double size) const {
    Random random(seed);
    Eigen::VectorXd result(model_.variables().size());
    for (double& value : result) value = size * random.normal();
    return result;
  }
  [[nodiscard]] Eigen::VectorXd gradient(const LinkageState& state) {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(model_.variables().size());
    flatness_.add_gradient(state, 0.7, result);
    return result;
  }

  LinkageModel model_ = testing::curved_model();
  LinkageState state_{model_};
  Flatness flatness_{model_};
};

TEST_F(NearestPlane, IsNearerThanAnyOther) {
  const double least = flatness_.value(state_);
  EXPECT_GT(least, 1);
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d point(random.uniform(0, 150), random.uniform(0, 100),
                                random.uniform(-5, 10));
    const Eigen::Vector3d normal(0.1 * random.normal(), 0.1 * random.normal(), 1);
    EXPECT_GT(Flatness(model_, Plane{point, normal}).value(state_), least);
  }
}

TEST_F(NearestPlane, MovesWithTheLinkage) {
  const double before = flatness_.value(state_);
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(model_.variables().size());
  for (int j = 0; j < model_.variables().joints(); ++j)
    shift.segment<3>(model_.variables().joint_begin(j) + kJointPosition) << 12, -7, 30;
  EXPECT_NEAR(flatness_.value(state_.moved(model_, shift)), before, 1e-9 * before);
  EXPECT_LT(std::abs(gradient(state_).dot(shift)), 1e-9 * gradient(state_).norm());
}

TEST_F(NearestPlane, DerivativesAgreeWithDifferences) {
  constexpr double kStep = 1e-4;
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Eigen::VectorXd v = increment(seed, 1);
    const LinkageState ahead = state_.moved(model_, kStep * v, LinkageState::Parts::kVertices);
    const LinkageState behind = state_.moved(model_, -kStep * v, LinkageState::Parts::kVertices);
    const double slope = 0.7 * (flatness_.value(ahead) - flatness_.value(behind)) / (2 * kStep);
    EXPECT_NEAR(gradient(state_).dot(v), slope, 1e-6 * gradient(state_).norm() * v.norm());
    Eigen::VectorXd second = Eigen::VectorXd::Zero(v.size());
    flatness_.add_second(state_, v, 0.7, second);
    const Eigen::VectorXd difference = (gradient(ahead) - gradient(behind)) / (2 * kStep);
    EXPECT_LT((second - difference).norm(), 1e-5 * second.norm());
  }
}

TEST_F(NearestPlane, OfJointsInALineIsAnyThroughIt) {
  LineMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0;
  mesh.edges.resize(2, 3);
  mesh.edges << 0, 1, 2, 1, 2, 3;
  const LinkageModel line(build_linkage_graph(mesh), 4, testing::kStrip);
  const LinkageState state(line);
  Flatness flatness(line);
  EXPECT_LT(flatness.value(state), 1e-20);
  Eigen::VectorXd second = Eigen::VectorXd::Zero(line.variables().size());
  flatness.add_second(state, Eigen::VectorXd::Ones(second.size()), 1, second);
  EXPECT_TRUE(second.allFinite());
}

}  // namespace
}  // namespace limber::rods
