#include "engine/rods/linkage/linkage_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <set>
#include <sstream>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using ::testing::HasSubstr;
using testing::known_linkages;
using testing::KnownLinkage;
using testing::linkage_file;
using testing::mesh_of;
using testing::sheared_grid;

/// Edges from vertex 0 in the given directions [degree] of the plane.
LineMesh star(const std::vector<double>& degrees) {
  std::vector<Eigen::Vector3d> vertices = {Eigen::Vector3d::Zero()};
  std::vector<Eigen::Vector2i> edges;
  for (const double degree : degrees) {
    edges.emplace_back(0, static_cast<int>(vertices.size()));
    vertices.emplace_back(std::cos(degree * kDegree), std::sin(degree * kDegree), 0);
  }
  return mesh_of(vertices, edges);
}

Error error_of(const LineMesh& mesh) {
  try {
    (void)build_linkage_graph(mesh);
  } catch (const Error& error) {
    return error;
  }
  return {ErrorCode::kInternal, "", "no error"};
}

/// What must hold of every joint: an orthonormal frame, segments along its tangents.
void expect_frames_fit(const LinkageGraph& graph, const LineMesh& mesh) {
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = graph.segments[s];
    const Eigen::Vector3d along =
        (mesh.vertices.col(segment.vertices[1]) - mesh.vertices.col(segment.vertices[0]))
            .normalized();
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      const Joint& joint = graph.joints[segment.joints[end]];
      const RodOfJoint rod = segment.rods[end];
      const bool ahead = (segment.signs[end] > 0) == (end == kStart);
      EXPECT_EQ(joint.segments[rod][ahead ? 1 : 0], static_cast<int>(s));
      EXPECT_GT(segment.signs[end] * joint.tangent(rod).dot(along), 0.5) << "segment " << s;
      EXPECT_NEAR(joint.normal.norm(), 1, 1e-14);
      EXPECT_NEAR(joint.bisector.norm(), 1, 1e-14);
      EXPECT_NEAR(joint.normal.dot(joint.bisector), 0, 1e-14);
      EXPECT_NEAR(joint.tangent(kRodA).cross(joint.tangent(kRodB)).dot(joint.normal),
                  std::sin(joint.opening_angle), 1e-14);
    }
  }
}

TEST(LinkageGraph, LoadsEveryKnownLinkage) {
  if (!std::filesystem::exists(linkage_file("burd_flat_opt_scaled"))) GTEST_SKIP() << "no data";
  for (const KnownLinkage& known : known_linkages()) {
    SCOPED_TRACE(known.name);
    const LineMesh mesh = scene::read_line_mesh_file(linkage_file(known.name));
    const LinkageGraph graph = build_linkage_graph(mesh);
    EXPECT_EQ(static_cast<int>(graph.joints.size()), known.joints);
    EXPECT_EQ(static_cast<int>(graph.segments.size()), known.segments);
    EXPECT_EQ(graph.components, 1);
    expect_frames_fit(graph, mesh);
    double mean = 0;
    for (const Joint& joint : graph.joints) {
      mean += joint.opening_angle / static_cast<double>(graph.joints.size());
    }
    EXPECT_LT(mean, std::numbers::pi / 2 + 1e-9);
    EXPECT_GT(mean, 0);
  }
}

struct ReferenceJoint {
  Eigen::Vector3d input;
  double closed_angle;
  std::array<std::set<int>, 2> rods;
};

std::vector<ReferenceJoint> read_reference_joints() {
  std::ifstream file(testing::shared_file("reference/burd_norestlen_joints.csv"));
  std::vector<ReferenceJoint> joints;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::vector<double> numbers;
    for (std::string word; std::getline(row, word, ',');) numbers.push_back(std::stod(word));
    ReferenceJoint joint{{numbers[1], numbers[2], numbers[3]}, numbers[7], {}};
    for (int k = 0; k < 4; ++k) {
      const int segment = static_cast<int>(numbers[15 + k]);
      if (segment >= 0) joint.rods[k / 2].insert(segment);
    }
    joints.push_back(joint);
  }
  return joints;
}

TEST(LinkageGraph, AgreesWithThePublicCodeOnBurd) {
  const std::vector<ReferenceJoint> reference = read_reference_joints();
  if (reference.empty()) GTEST_SKIP() << "no data";
  const LinkageGraph graph =
      build_linkage_graph(scene::read_line_mesh_file(linkage_file("burd_flat_opt_scaled")));
  ASSERT_EQ(graph.joints.size(), reference.size());
  double mean = 0;
  for (std::size_t j = 0; j < reference.size(); ++j) {
    const Joint& joint = graph.joints[j];
    EXPECT_LT((joint.position - reference[j].input).norm(), 1e-6);
    EXPECT_NEAR(joint.normal.z(), 1, 1e-6);
    // Equilibrium moves the closed angles a little; their supplements are far away.
    EXPECT_NEAR(joint.opening_angle, reference[j].closed_angle, 2 * kDegree) << "joint " << j;
    mean += joint.opening_angle / static_cast<double>(reference.size());
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      std::set<int> own;
      for (const int segment : joint.segments[rod]) {
        if (segment >= 0) own.insert(segment);
      }
      EXPECT_EQ(own, reference[j].rods[rod]) << "joint " << j << " rod " << rod;
    }
  }
  EXPECT_NEAR(mean, 4.029 * kDegree, 0.5 * kDegree);
}

TEST(LinkageGraph, PairsTheStraightest) {
  const LinkageGraph three = build_linkage_graph(star({0, 60, 175}));
  EXPECT_EQ(three.joints[0].valence, 3);
  const auto& rods = three.joints[0].segments;
  const int through = rods[kRodA][0] >= 0 && rods[kRodA][1] >= 0 ? kRodA : kRodB;
  EXPECT_EQ(std::set<int>(rods[through].begin(), rods[through].end()), (std::set<int>{0, 2}));
  const LinkageGraph four = build_linkage_graph(star({0, 20, 185, 190}));
  const auto& crossing = four.joints[0].segments;
  const auto set_of = [](const std::array<int, 2>& pair) {
    return std::set<int>(pair.begin(), pair.end());
  };
  EXPECT_THAT((std::vector{set_of(crossing[0]), set_of(crossing[1])}),
              ::testing::UnorderedElementsAre(std::set<int>{0, 2}, std::set<int>{1, 3}));
}

TEST(LinkageGraph, OpeningAngleIsTheSameOverAShearedGrid) {
  for (const double degrees : {3.0, 30.0, 89.0, 120.0, 177.0}) {
    const LineMesh mesh = sheared_grid(5, 4, degrees * kDegree);
    const LinkageGraph graph = build_linkage_graph(mesh);
    expect_frames_fit(graph, mesh);
    for (const Joint& joint : graph.joints)
      EXPECT_NEAR(joint.opening_angle, std::min(degrees, 180 - degrees) * kDegree, 1e-12);
  }
}

TEST(LinkageGraph, AnglesAreContinuousThroughZero) {
  // Rods fan out to both sides: the angle passes through zero between two joints of a rod.
  const double open = 2 * kDegree;
  const LineMesh mesh = mesh_of({{0, 0, 0},
                                 {10, 0, 0},
                                 {20, 0, 0},
                                 {30, 0, 0},
                                 {10 + 5 * std::cos(open), 5 * std::sin(open), 0},
                                 {5 * std::cos(open), 5 * std::sin(open), 0},
                                 {20 + 5 * std::cos(open), -5 * std::sin(open), 0}},
                                {{0, 1}, {1, 2}, {2, 3}, {1, 4}, {0, 5}, {2, 6}});
  const LinkageGraph graph = build_linkage_graph(mesh);
  ASSERT_EQ(graph.joints.size(), 3u);
  EXPECT_NEAR(graph.joints[0].opening_angle, open, 1e-12);
  EXPECT_NEAR(graph.joints[1].opening_angle, open, 1e-12);
  EXPECT_NEAR(graph.joints[2].opening_angle, -open, 1e-12);
  expect_frames_fit(graph, mesh);
}

TEST(LinkageGraph, FullyClosedJointsTakeTheirNormalFromNeighbours) {
  LineMesh mesh = sheared_grid(3, 3, 40 * kDegree);
  // A joint at the tip whose two segments are collinear.
  const int corner = 8;
  mesh.vertices.conservativeResize(3, 10);
  mesh.vertices.col(9) = 2 * mesh.vertices.col(corner) - mesh.vertices.col(7);
  mesh.vertices.col(9).z() = 0;
  mesh.edges.conservativeResize(2, mesh.edges.cols() + 1);
  mesh.edges.col(mesh.edges.cols() - 1) << corner, 9;
  mesh.vertices.conservativeResize(3, 11);
  mesh.vertices.col(10) = mesh.vertices.col(9) + (mesh.vertices.col(9) - mesh.vertices.col(corner));
  mesh.edges.conservativeResize(2, mesh.edges.cols() + 1);
  mesh.edges.col(mesh.edges.cols() - 1) << 9, 10;
  const LinkageGraph graph = build_linkage_graph(mesh);
  EXPECT_NEAR(std::abs(graph.joints[9].normal.z()), 1, 1e-12);
  EXPECT_NEAR(std::sin(graph.joints[9].opening_angle), 0, 1e-12);
  expect_frames_fit(graph, mesh);
}

TEST(LinkageGraph, SeveralComponentsAndFreeRods) {
  const LineMesh mesh = mesh_of({{0, 0, 0},
                                 {1, 0, 0},
                                 {0, 1, 0},
                                 {5, 0, 0},
                                 {6, 0, 0},
                                 {5, 1, 0},
                                 {9, 9, 9},
                                 {9, 9, 8},
                                 {0, 0, 9}},
                                {{0, 1}, {0, 2}, {3, 4}, {5, 3}, {6, 7}});
  const LinkageGraph graph = build_linkage_graph(mesh);
  EXPECT_EQ(graph.components, 3);
  EXPECT_THAT(graph.segment_components, ::testing::ElementsAre(0, 0, 1, 1, 2));
  EXPECT_EQ(graph.joints.size(), 2u);
  EXPECT_THAT(graph.segments[4].joints, ::testing::ElementsAre(-1, -1));
  expect_frames_fit(graph, mesh);
}

TEST(LinkageGraph, TriangleOfRodsHasMixedAngles) {
  // Three rods that cross pairwise: each would have to be both A and B.
  const LineMesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {0.5, 0.9, 0}}, {{0, 1}, {1, 2}, {2, 0}});
  const LinkageGraph graph = build_linkage_graph(mesh);
  EXPECT_TRUE(graph.mixed_angles);
  expect_frames_fit(graph, mesh);
  EXPECT_FALSE(build_linkage_graph(sheared_grid(4, 3, 1.1)).mixed_angles);
}

TEST(LinkageGraph, OneSidedSurfacesAreRefused) {
  // A band of cells that closes after half a turn.
  const int cells = 24;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2i> edges;
  for (int i = 0; i < cells; ++i) {
    const double along = 360.0 * i / cells * kDegree;
    for (const double side : {-1.0, 1.0}) {
      const double radius = 5 + side * std::cos(along / 2);
      vertices.emplace_back(radius * std::cos(along), radius * std::sin(along),
                            side * std::sin(along / 2));
    }
    edges.emplace_back(2 * i, 2 * i + 1);
    const bool last = i + 1 == cells;
    for (const int side : {0, 1})
      edges.emplace_back(2 * i + side, last ? 1 - side : 2 * (i + 1) + side);
  }
  EXPECT_THAT(error_of(mesh_of(vertices, edges)).what(), HasSubstr("one side only"));
}

TEST(LinkageGraph, BadInputNamesTheEdgeOrVertex) {
  const LineMesh good = sheared_grid(3, 3, 1.0);
  LineMesh bad = good;
  bad.edges(1, 4) = 9;
  EXPECT_EQ(error_of(bad).code(), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of(bad).field(), "edges[4]");
  bad.edges(1, 4) = -1;
  EXPECT_EQ(error_of(bad).field(), "edges[4]");
  bad = good;
  bad.edges.col(5) = bad.edges.col(2).reverse();
  EXPECT_EQ(error_of(bad).field(), "edges[5]");
  EXPECT_THAT(error_of(bad).what(), HasSubstr("as edge 2 does"));
  bad = good;
  bad.edges(0, 3) = bad.edges(1, 3);
  EXPECT_THAT(error_of(bad).what(), HasSubstr("with itself"));
  bad = good;
  bad.vertices.col(good.edges(0, 6)) = bad.vertices.col(good.edges(1, 6));
  EXPECT_EQ(error_of(bad).field(), "edges[6]");
  bad = good;
  bad.vertices(1, 7) = std::nan("");
  EXPECT_EQ(error_of(bad).field(), "vertices[7]");
  bad.vertices(1, 7) = 1e160;  // squares overflow
  EXPECT_THAT(error_of(bad).what(), HasSubstr("vertex 7 (from 0) has a coordinate beyond 1e+100"));
  EXPECT_EQ(error_of(star({0, 50, 100, 200, 300})).field(), "vertices[0]");
  EXPECT_THAT(error_of(star({0, 50, 100, 200, 300})).what(), HasSubstr("5 edges meet at vertex 0"));
  EXPECT_EQ(error_of(LineMesh{}).field(), "edges");
  EXPECT_EQ(error_of(star({10, 10.0, 10, 10})).field(), "vertices[0]");
}

}  // namespace
}  // namespace limber::rods
