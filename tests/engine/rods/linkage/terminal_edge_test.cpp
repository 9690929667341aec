#include "engine/rods/linkage/terminal_edge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "tests/engine/rods/linkage/differences.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using testing::derivative;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Vector9 = JointIncrement<double>;

Eigen::Vector3d random_point(Random& random, double size = 1) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

JointState<double> random_joint(Random& random) {
  JointState<double> joint;
  joint.position = random_point(random);
  joint.normal = random_point(random).normalized();
  joint.bisector = joint.normal.cross(random_point(random)).normalized();
  joint.opening_angle = random.uniform(-0.5, 3.5);
  joint.lengths[0] = random.uniform(0.5, 2);
  joint.lengths[1] = random.uniform(0.5, 2);
  return joint;
}

Vector9 random_step(Random& random, double size) {
  Vector9 x;
  for (int i = 0; i < 9; ++i) x[i] = random.uniform(-size, size);
  return x;
}

Vector7 numbers(const TerminalEdge<double>& edge) {
  Vector7 v;
  v.head<3>() = edge.first;
  v[3] = edge.turn;
  v.tail<3>() = edge.second;
  return v;
}

/// The same edge from the definitions: Rodrigues' formula, and the angle from the transported
/// director to the normal.
Vector7 edge_by_definition(const JointState<double>& joint, RodOfJoint rod, int sign,
                           const Vector9& x) {
  const Eigen::Matrix3d rotation = rotations::exponential(x.segment<3>(3));
  JointState<double> moved = joint;
  moved.opening_angle += x[6];
  const Eigen::Vector3d t0 = sign * joint.tangent(rod);
  const Eigen::Vector3d t1 = sign * (rotation * moved.tangent(rod));
  const Eigen::Vector3d normal = rotation * joint.normal;
  const double length = joint.lengths[rod] + x[7 + rod];
  const Eigen::Vector3d axis = t0.cross(t1);
  const Eigen::Vector3d carried = joint.normal + axis.cross(joint.normal) +
                                  axis.cross(axis.cross(joint.normal)) / (1 + t0.dot(t1));
  const Eigen::Vector3d centre = joint.position + x.head<3>();
  Vector7 v;
  v.head<3>() = centre - length / 2 * t1;
  v[3] = std::atan2(carried.cross(normal).dot(t1), carried.dot(normal));
  v.tail<3>() = centre + length / 2 * t1;
  return v;
}

struct EndCase {
  RodOfJoint rod;
  int sign;
};

class TerminalEdgeTest : public ::testing::TestWithParam<EndCase> {};

TEST_P(TerminalEdgeTest, IsWhatTheDefinitionsSay) {
  Random random(1);
  const auto [rod, sign] = GetParam();
  for (int k = 0; k < 50; ++k) {
    const JointState<double> joint = random_joint(random);
    const Vector9 x = random_step(random, k < 25 ? 0.7 : 1e-4);
    const Vector7 direct = numbers(terminal_edge(terminal_edge_source(joint, rod, sign), x));
    EXPECT_LT((direct - edge_by_definition(joint, rod, sign, x)).norm(), 1e-13);
  }
}

TEST_P(TerminalEdgeTest, JacobianAgreesWithDifferences) {
  Random random(2);
  const auto [rod, sign] = GetParam();
  for (int k = 0; k < 20; ++k) {
    const TerminalEdgeSource<double> source = terminal_edge_source(random_joint(random), rod, sign);
    const TerminalJacobian<double> jacobian = terminal_jacobian(source);
    for (int i = 0; i < 9; ++i) {
      const Vector7 difference = derivative(
          [&](double h) { return numbers(terminal_edge<double>(source, h * Vector9::Unit(i))); },
          2e-3);
      EXPECT_LT((difference - jacobian.col(i)).norm(), 1e-10) << "unknown " << i;
    }
  }
}

TEST_P(TerminalEdgeTest, GradientIsTheJacobiansTransposeTimesIt) {
  Random random(8);
  const auto [rod, sign] = GetParam();
  for (int k = 0; k < 20; ++k) {
    const TerminalEdgeSource<double> source = terminal_edge_source(random_joint(random), rod, sign);
    Vector7 gradient;
    for (double& value : gradient) value = random.normal();
    const Vector9 expected = terminal_jacobian(source).transpose() * gradient;
    EXPECT_LT((terminal_gradient(source, gradient) - expected).norm(), 1e-14 * expected.norm());
  }
}

TEST_P(TerminalEdgeTest, CurvatureAgreesWithDifferences) {
  Random random(3);
  const auto [rod, sign] = GetParam();
  for (int k = 0; k < 20; ++k) {
    const TerminalEdgeSource<double> source = terminal_edge_source(random_joint(random), rod, sign);
    Vector7 gradient;
    for (int i = 0; i < 7; ++i) gradient[i] = random.uniform(-1, 1);
    const Eigen::Matrix<double, 9, 9> curvature = terminal_curvature(source, gradient);
    const auto work = [&](double hi, int i, double hj, int j) {
      return gradient.dot(
          numbers(terminal_edge<double>(source, hi * Vector9::Unit(i) + hj * Vector9::Unit(j))));
    };
    for (int i = 0; i < 9; ++i) {
      for (int j = 0; j < 9; ++j) {
        const double difference = derivative(
            [&](double hi) {
              return derivative([&](double hj) { return work(hi, i, hj, j); }, 1e-2);
            },
            1e-2);
        EXPECT_NEAR(difference, curvature(i, j), 1e-8) << i << " " << j;
      }
    }
  }
}

TEST_P(TerminalEdgeTest, IncrementsFromANewStateContinue) {
  // Away from the source: advancing and then differentiating is differentiating there.
  Random random(4);
  const auto [rod, sign] = GetParam();
  const JointState<double> joint = random_joint(random);
  const Vector9 x = random_step(random, 0.8);
  const JointState<double> moved = advanced(joint, x);
  const TerminalEdge<double> there = terminal_edge(terminal_edge_source(joint, rod, sign), x);
  const TerminalEdge<double> again =
      terminal_edge<double>(terminal_edge_source(moved, rod, sign), Vector9::Zero());
  EXPECT_LT((there.first - again.first).norm(), 1e-14);
  EXPECT_LT((there.second - again.second).norm(), 1e-14);
  EXPECT_EQ(again.turn, 0);
  EXPECT_LT((rotations::exponential(x.segment<3>(3)) * joint.normal - moved.normal).norm(), 1e-14);
}

INSTANTIATE_TEST_SUITE_P(BothRodsBothWays, TerminalEdgeTest,
                         ::testing::Values(EndCase{kRodA, 1}, EndCase{kRodA, -1}, EndCase{kRodB, 1},
                                           EndCase{kRodB, -1}));

TEST(TerminalEdge, TurnsOfAlmostHalfARoundAreFollowed) {
  Random random(5);
  const JointState<double> joint = random_joint(random);
  Vector9 x = Vector9::Zero();
  for (const double angle : {-3.1, -1e-9, 1e-6, 1e-3, 3.0, 3.14159}) {
    x.segment<3>(3) = angle * joint.tangent(kRodB);
    const TerminalEdge<double> edge = terminal_edge(terminal_edge_source(joint, kRodB, 1), x);
    EXPECT_NEAR(edge.turn, angle, 4e-15 + 1e-15 * std::abs(angle));
    EXPECT_LT((edge.second - edge.first - joint.lengths[1] * joint.tangent(kRodB)).norm(), 1e-14);
  }
}

/// Valence 2, 3 and 4: every segment at a joint lies on its own side and shares its rod's edge.
TEST(TerminalEdge, SegmentsOfARodShareOneEdgeAtEveryValence) {
  const LineMesh mesh = testing::sheared_grid(3, 3, 0.9);
  const LinkageGraph graph = build_linkage_graph(mesh);
  Random random(6);
  std::array<int, 5> valences{};
  for (const Joint& joint : graph.joints) {
    ++valences[joint.valence];
    const JointState<double> state{
        joint.position, joint.normal, joint.bisector, joint.opening_angle, {0.1, 0.2}};
    const Vector9 x = random_step(random, 0.3);
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      for (const int ahead : {0, 1}) {
        const int s = joint.segments[rod][ahead];
        if (s < 0) continue;
        const Segment& segment = graph.segments[s];
        const End end = graph.joints[segment.joints[0]].vertex == joint.vertex ? kStart : kFinish;
        ASSERT_EQ(segment.rods[end], rod);
        const TerminalEdge<double> edge =
            terminal_edge(terminal_edge_source(state, rod, segment.signs[end]), x);
        const TerminalEdge<double> along = terminal_edge(terminal_edge_source(state, rod, 1), x);
        const bool agrees = segment.signs[end] > 0;
        EXPECT_EQ(agrees ? edge.first : edge.second, along.first);
        EXPECT_EQ(agrees ? edge.second : edge.first, along.second);
        EXPECT_EQ(agrees ? edge.turn : -edge.turn, along.turn);
        // The far vertex lies towards the segment's other end.
        const Eigen::Vector3d far = mesh.vertices.col(segment.vertices[1 - end]);
        const TerminalEdge<double> rest = terminal_edge<double>(
            terminal_edge_source(state, rod, segment.signs[end]), Vector9::Zero());
        const Eigen::Vector3d towards = end == kStart ? rest.second : rest.first;
        const Eigen::Vector3d beyond = end == kStart ? rest.first : rest.second;
        EXPECT_LT((towards - far).norm(), (beyond - far).norm());
      }
    }
  }
  EXPECT_EQ(valences[2], 4);
  EXPECT_EQ(valences[3], 4);
  EXPECT_EQ(valences[4], 1);
}

}  // namespace
}  // namespace limber::rods
