// Weaves over balls and tori, and great circles: the rods are those that are drawn, on one side or
// the other of a surface that has two.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/rod_chains.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/weaves.h"

namespace limber::rods {
namespace {

using ::testing::HasSubstr;

std::string weave_refusal(const LineMesh& mesh, std::string* field = nullptr) {
  try {
    (void)build_linkage_graph(mesh);
  } catch (const Error& error) {
    if (field != nullptr) *field = error.field();
    return error.what();
  }
  return "";
}

LineMesh roughened(LineMesh mesh, double by, std::uint32_t seed) {
  std::mt19937 random(seed);
  const double most = static_cast<double>(std::mt19937::max());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    for (int axis = 0; axis < 3; ++axis)
      mesh.vertices(axis, v) += by * (2 * static_cast<double>(random()) / most - 1);
  return mesh;
}

double mean_line_length(const LineMesh& mesh) {
  double sum = 0;
  for (int e = 0; e < mesh.edge_count(); ++e)
    sum += (mesh.vertices.col(mesh.edges(1, e)) - mesh.vertices.col(mesh.edges(0, e))).norm();
  return sum / mesh.edge_count();
}

/// How many normals point out of the ball.
int outward_count(const LinkageGraph& graph) {
  return static_cast<int>(
      std::count_if(graph.joints.begin(), graph.joints.end(),
                    [](const Joint& joint) { return joint.normal.dot(joint.position) > 0; }));
}

/// All normals point out of the ball.
void expect_outward(const LinkageGraph& graph) {
  EXPECT_EQ(outward_count(graph), static_cast<int>(graph.joints.size()));
}

/// All normals point out of the ball, or all into it.
void expect_one_side(const LinkageGraph& graph) {
  const int count = outward_count(graph);
  EXPECT_TRUE(count == 0 || count == static_cast<int>(graph.joints.size())) << count;
}

TEST(Weaves, GreatCirclesAreRingsThatTheyAreDrawnAs) {
  for (const int circles : {3, 4, 6}) {
    const LinkageGraph graph =
        build_linkage_graph(testing::great_circles(testing::regular_axes(circles)));
    EXPECT_EQ(graph.bent_joints, 0);
    expect_outward(graph);
    const std::vector<RodChain> rods = rod_chains(graph);
    ASSERT_EQ(rods.size(), static_cast<std::size_t>(circles));
    for (const RodChain& rod : rods) {
      EXPECT_TRUE(rod.is_closed);
      ASSERT_EQ(rod.segments.size(), static_cast<std::size_t>(2 * (circles - 1)));
      Eigen::Matrix3Xd points(3, rod.segments.size());
      for (std::size_t k = 0; k < rod.segments.size(); ++k) {
        const Segment& segment = graph.segments[rod.segments[k]];
        points.col(static_cast<Eigen::Index>(k)) = segment.points[rod.reversed[k] != 0 ? 1 : 0];
      }
      // In one plane through the middle.
      EXPECT_LT(points.jacobiSvd().singularValues()[2], 1e-12);
    }
  }
}

/// Three circles have letters at all joints but for one family too many; so have four and six.
TEST(Weaves, ThreeFamiliesHaveMixedAngles) {
  for (const LineMesh& mesh :
       {testing::great_circles(testing::regular_axes(3)),
        testing::great_circles(testing::regular_axes(4)),
        testing::great_circles(testing::regular_axes(6)), testing::weave_over(testing::ball(1)),
        testing::weave_over(testing::torus(12, 8, 2, 0.8))}) {
    const LinkageGraph graph = build_linkage_graph(mesh);
    EXPECT_TRUE(graph.mixed_angles);
    for (const Joint& joint : graph.joints) {
      EXPECT_GT(joint.opening_angle, 0);
      EXPECT_LE(joint.opening_angle, std::numbers::pi / 2 + 1e-9);
    }
  }
}

TEST(Weaves, OverBallsHaveTwoSidesHoweverRough) {
  for (const int times : {0, 1, 2}) {
    const LineMesh mesh = testing::weave_over(testing::ball(times));
    for (const double by : {0.0, 0.1, 0.2}) {
      for (std::uint32_t seed = 1; seed <= (by > 0 ? 5u : 1u); ++seed) {
        const LineMesh rough = roughened(mesh, by * mean_line_length(mesh), seed);
        ASSERT_EQ(weave_refusal(rough), "") << times << ' ' << by << ' ' << seed;
        if (by < 0.2) expect_one_side(build_linkage_graph(rough));
      }
    }
    LineMesh flat = mesh;
    flat.vertices.row(2) *= 0.3;
    expect_outward(build_linkage_graph(flat));
  }
}

TEST(Weaves, OverToriHaveTwoSidesHoweverCoarse) {
  for (const auto& [along, across] : {std::pair{7, 4}, {8, 5}, {12, 6}, {30, 12}}) {
    for (const double tube : {0.5, 1.0, 1.5}) {
      const LineMesh mesh = testing::weave_over(testing::torus(along, across, 2, tube));
      ASSERT_EQ(weave_refusal(mesh), "") << along << ' ' << across << ' ' << tube;
      const LinkageGraph graph = build_linkage_graph(mesh);
      int outward = 0;
      for (const Joint& joint : graph.joints) {
        const Eigen::Vector3d core =
            2 * Eigen::Vector3d(joint.position.x(), joint.position.y(), 0).normalized();
        if ((joint.position - core).dot(joint.normal) > 0) ++outward;
      }
      // Which of the two is up to the rule; all have the same.
      EXPECT_TRUE(outward == 0 || outward == static_cast<int>(graph.joints.size()))
          << along << ' ' << across << ' ' << tube << ": " << outward;
    }
  }
}

TEST(Weaves, OverAKleinBottleHaveOneSide) {
  EXPECT_THAT(weave_refusal(testing::weave_over(testing::klein_bottle(20, 12))),
              HasSubstr("has one side only"));
  EXPECT_THAT(weave_refusal(testing::weave_over(testing::klein_bottle(40, 20))),
              HasSubstr("has one side only"));
}

TEST(Weaves, SegmentsOfARodFollowEachOther) {
  for (const LineMesh& mesh :
       {testing::great_circles(testing::regular_axes(6)),
        testing::weave_over(testing::torus(8, 5, 2, 1)), testing::sheared_grid(5, 4, 1.1),
        testing::weave_over(testing::ball(1))}) {
    const LinkageGraph graph = build_linkage_graph(mesh);
    std::vector<int> met(graph.segments.size(), 0);
    for (const RodChain& rod : rod_chains(graph)) {
      ASSERT_EQ(rod.segments.size(), rod.reversed.size());
      const std::size_t count = rod.segments.size();
      for (std::size_t k = 0; k < count; ++k) {
        ++met[rod.segments[k]];
        const bool has_next = k + 1 < count || rod.is_closed;
        const Segment& segment = graph.segments[rod.segments[k]];
        const int end = rod.reversed[k] != 0 ? kStart : kFinish;
        if (!has_next) continue;
        const std::size_t after = (k + 1) % count;
        const Segment& next = graph.segments[rod.segments[after]];
        const int begin = rod.reversed[after] != 0 ? kFinish : kStart;
        ASSERT_EQ(segment.joints[end], next.joints[begin]);
        EXPECT_EQ(segment.rods[end], next.rods[begin]);
      }
    }
    EXPECT_EQ(met, std::vector<int>(graph.segments.size(), 1));
  }
}

TEST(Weaves, GivenNormalsSayWhichSideIsUp) {
  LineMesh mesh = testing::weave_over(testing::ball(1));
  mesh.normals = -3 * mesh.vertices;
  for (const Joint& joint : build_linkage_graph(mesh).joints)
    EXPECT_LT(joint.normal.dot(joint.position), 0);
  mesh.normals = mesh.vertices;
  expect_outward(build_linkage_graph(mesh));

  // Rods that lie on each other turn about the given normal.
  LineMesh closed =
      testing::lines_of({{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {-1, 0, 0.1}, {1, 0, -0.1}},
                        {{0, 1}, {1, 2}, {3, 1}, {1, 4}});
  closed.vertices(2, 3) = closed.vertices(2, 4) = 0;
  closed.vertices(0, 3) = -1.1;
  closed.vertices(0, 4) = 1.1;
  closed.normals = Eigen::Vector3d(0.2, 1, 0).replicate(1, 5);
  EXPECT_LT((build_linkage_graph(closed).joints[0].normal - Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

TEST(Weaves, NormalsThatCannotBeAreRefusedByTheirNumber) {
  std::string field;
  LineMesh mesh = testing::sheared_grid(3, 3, 1.1);
  mesh.normals = Eigen::Vector3d::UnitZ().replicate(1, mesh.vertices.cols());
  EXPECT_EQ(weave_refusal(mesh), "");
  const auto with = [&](int vertex, const Eigen::Vector3d& normal) {
    LineMesh changed = mesh;
    changed.normals.col(vertex) = normal;
    return changed;
  };
  EXPECT_THAT(weave_refusal(with(4, -Eigen::Vector3d::UnitZ()), &field),
              HasSubstr("different sides"));
  EXPECT_THAT(weave_refusal(with(4, Eigen::Vector3d::UnitX()), &field), HasSubstr("in the plane"));
  EXPECT_EQ(field, "normals[4]");
  EXPECT_THAT(weave_refusal(with(2, Eigen::Vector3d::Zero()), &field), HasSubstr("not zero"));
  EXPECT_EQ(field, "normals[2]");
  EXPECT_NE(weave_refusal(with(2, Eigen::Vector3d(0, 0, std::nan(""))), &field), "");
  mesh.normals.conservativeResize(3, 5);
  EXPECT_THAT(weave_refusal(mesh, &field), HasSubstr("5 normals are given for 9 vertices"));
}

}  // namespace
}  // namespace limber::rods
