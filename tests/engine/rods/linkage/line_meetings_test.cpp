// Lines that touch where nothing joins them.

#include "engine/rods/linkage/line_meetings.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "engine/scene/formats/line_formats.h"
#include "engine/scene/samples/linkage_samples.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using testing::mesh_of;

TEST(LineMeetings, TwoLinesThatCross) {
  const double scales[] = {1e-3, 1, 1e6};
  for (const double scale : scales) {
    const LineMesh mesh =
        mesh_of({{-scale, 0, 0}, {scale, 0, 0}, {0, -scale, 0}, {0, scale, 0}}, {{0, 1}, {2, 3}});
    const LineMeetings found = find_line_meetings(mesh);
    ASSERT_EQ(found.count, 1);
    EXPECT_EQ(found.listed[0].kind, LineMeeting::Kind::kEdges);
    EXPECT_EQ(found.listed[0].edges, Eigen::Vector2i(0, 1));
    EXPECT_LT(found.listed[0].place.norm(), 1e-9 * scale);
  }
}

TEST(LineMeetings, PassingOverIsNoMeeting) {
  const auto apart = [](double height) {
    return find_line_meetings(
               mesh_of({{-1, 0, 0}, {1, 0, 0}, {0, -1, height}, {0, 1, height}}, {{0, 1}, {2, 3}}))
        .count;
  };
  EXPECT_EQ(apart(0.01), 0);
  EXPECT_EQ(apart(1e-4), 1);  // what files round to
}

TEST(LineMeetings, AnEndOnALineAndTwoEndsAtOnePlace) {
  const LineMeetings on = find_line_meetings(
      mesh_of({{-1, 0, 0}, {1, 0, 0}, {0.25, 0, 0}, {0.25, 1, 0}}, {{0, 1}, {2, 3}}));
  ASSERT_EQ(on.count, 1);
  EXPECT_EQ(on.listed[0].kind, LineMeeting::Kind::kVertexEdge);
  EXPECT_EQ(on.listed[0].vertices, Eigen::Vector2i(-1, 2));
  // Two rods of two edges each through one place: of four pairs of edges one is reported.
  const LineMeetings twins = find_line_meetings(
      mesh_of({{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 0, 0}, {0, 1, 0}},
              {{0, 1}, {1, 2}, {3, 4}, {4, 5}}));
  ASSERT_EQ(twins.count, 1);
  EXPECT_EQ(twins.listed[0].kind, LineMeeting::Kind::kVertices);
  EXPECT_EQ(twins.listed[0].vertices, Eigen::Vector2i(1, 4));
}

TEST(LineMeetings, ARodThatIsCutIsReportedAndRodsSideBySideAreNot) {
  const LineMeetings cut =
      find_line_meetings(mesh_of({{-1, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 0, 0}}, {{0, 1}, {2, 3}}));
  ASSERT_EQ(cut.count, 1);
  EXPECT_EQ(cut.listed[0].vertices, Eigen::Vector2i(1, 2));
  EXPECT_EQ(
      find_line_meetings(mesh_of({{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {3, 0, 0}}, {{0, 1}, {2, 3}}))
          .count,
      0);
}

TEST(LineMeetings, OpenAndClosedGridsHaveNone) {
  for (const double angle : {0.0, 1e-3, 0.05, 0.5, 1.5})
    EXPECT_EQ(find_line_meetings(testing::sheared_grid(9, 9, angle)).count, 0) << angle;
}

TEST(LineMeetings, AVertexThatIsTwoIsFoundInALargeGrid) {
  LineMesh mesh = testing::sheared_grid(150, 150, 1.2);  // 44,700 edges
  const auto middle = static_cast<Eigen::Index>(75 * 150 + 75);
  Eigen::Matrix3Xd vertices(3, mesh.vertices.cols() + 1);
  vertices << mesh.vertices, mesh.vertices.col(middle);
  mesh.vertices = vertices;
  for (Eigen::Index e = 0; e < mesh.edges.cols(); ++e) {
    if (mesh.edges(0, e) != middle) continue;
    mesh.edges(0, e) = mesh.vertex_count() - 1;
    break;
  }
  const LineMeetings found = find_line_meetings(mesh);
  ASSERT_EQ(found.count, 1);
  EXPECT_EQ(found.listed[0].kind, LineMeeting::Kind::kVertices);
  EXPECT_EQ(found.listed[0].vertices.minCoeff(), middle);
}

TEST(LineMeetings, AreThoseOfLookingAtEveryPair) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in(-1, 1);
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2i> edges;
  for (int e = 0; e < 60; ++e) {
    vertices.emplace_back(in(random), in(random), 0);
    vertices.push_back(vertices.back() + Eigen::Vector3d(0.2 * in(random), 0.6 * in(random), 0));
    edges.emplace_back(2 * e, 2 * e + 1);
  }
  std::set<std::pair<int, int>> expected;
  for (int a = 0; a < 60; ++a) {
    for (int b = a + 1; b < 60; ++b) {
      Eigen::Matrix2d directions;
      const auto at = [&](int v) { return vertices[static_cast<std::size_t>(v)].head<2>(); };
      directions << at(2 * a + 1) - at(2 * a), at(2 * b) - at(2 * b + 1);
      const Eigen::Vector2d shares = directions.inverse() * (at(2 * b) - at(2 * a));
      const double sine = std::abs(directions.determinant()) /
                          (directions.col(0).norm() * directions.col(1).norm());
      if (sine > 0.1 && shares.minCoeff() > 0 && shares.maxCoeff() < 1) expected.emplace(a, b);
    }
  }
  const LineMeetings found = find_line_meetings(mesh_of(vertices, edges), 1000);
  ASSERT_GT(expected.size(), 10U);
  std::set<std::pair<int, int>> pairs;
  for (const LineMeeting& meeting : found.listed) {
    // One ends a ten-thousandth short of another.
    if (meeting.kind == LineMeeting::Kind::kEdges)
      pairs.emplace(meeting.edges[0], meeting.edges[1]);
  }
  EXPECT_EQ(pairs, expected);
}

/// Lines along x across lines along y.
LineMesh lattice(int rows, int columns) {
  const double width = columns, height = rows;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2i> edges;
  const auto draw = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    edges.emplace_back(static_cast<int>(vertices.size()), static_cast<int>(vertices.size()) + 1);
    vertices.push_back(from);
    vertices.push_back(to);
  };
  for (int r = 0; r < rows; ++r) draw({-1, 1.0 * r, 0}, {width, 1.0 * r, 0});
  for (int c = 0; c < columns; ++c) draw({1.0 * c, -1, 0}, {1.0 * c, height, 0});
  return mesh_of(vertices, edges);
}

TEST(LineMeetings, FewAreListedAndAllCounted) {
  const LineMeetings found = find_line_meetings(lattice(5, 5), 4);
  EXPECT_EQ(found.count, 25);
  EXPECT_TRUE(found.all);
  EXPECT_EQ(found.listed.size(), 4U);
}

TEST(LineMeetings, AThousandAreFoundAndWhetherThereAreMoreIsReported) {
  const LineMeetings whole = find_line_meetings(lattice(25, 40));
  EXPECT_EQ(whole.count, 1000);
  EXPECT_TRUE(whole.all);
  for (const int columns : {41, 200}) {
    const LineMeetings part = find_line_meetings(lattice(25, columns));
    EXPECT_EQ(part.count, 1000);
    EXPECT_FALSE(part.all);
  }
}

TEST(LineMeetings, LinesThatAreNearlyParallelAreNotReported) {
  for (const auto& [degrees, count] : {std::pair{5.6, 0}, std::pair{5.9, 1}}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), 0);
    EXPECT_EQ(find_line_meetings(
                  mesh_of({{-1, 0, 0}, {1, 0, 0}, -direction, direction}, {{0, 1}, {2, 3}}))
                  .count,
              count)
        << degrees;
  }
}

TEST(LineMeetings, SamplesAndPublicModelsHaveNone) {
  for (const std::string& name : scene::linkage_sample_names())
    EXPECT_EQ(find_line_meetings(scene::make_linkage_sample(name).lines).count, 0) << name;
  for (const char* name : {"AsymmOverhanging2BumpsArchitecturalScale", "burd_flat_opt_scaled",
                           "darth_vader_pavilion", "etienne_hyperboloid_measured", "fish_linkage",
                           "hourglass", "hyperboloid_closed", "single_linkage", "two_rods"}) {
    if (!std::filesystem::exists(testing::linkage_file(name))) continue;
    EXPECT_EQ(find_line_meetings(scene::read_line_mesh_file(testing::linkage_file(name))).count, 0)
        << name;
  }
}

}  // namespace
}  // namespace limber::rods
