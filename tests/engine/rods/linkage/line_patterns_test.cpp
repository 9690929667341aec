// Patterns of lines whose straightest pairs of segments contradict each other, and surfaces with
// one side: what is chosen must be consistent and must not depend on numbers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using ::testing::HasSubstr;
using testing::known_linkages;
using testing::linkage_file;
using testing::sheared_grid;

/// Lines by their ends; ends that coincide are one vertex.
class Drawing {
 public:
  int vertex(const Eigen::Vector3d& point) {
    const auto key = std::array{std::lround(1e6 * point.x()), std::lround(1e6 * point.y()),
                                std::lround(1e6 * point.z())};
    const auto [found, is_new] = numbers_.emplace(key, static_cast<int>(points_.size()));
    if (is_new) points_.push_back(point);
    return found->second;
  }
  void line(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const auto ends = std::minmax({vertex(from), vertex(to)});
    if (known_.insert(ends).second) edges_.emplace_back(ends.first, ends.second);
  }
  [[nodiscard]] LineMesh mesh() const {
    LineMesh mesh;
    mesh.vertices.resize(3, static_cast<Eigen::Index>(points_.size()));
    for (std::size_t i = 0; i < points_.size(); ++i)
      mesh.vertices.col(static_cast<Eigen::Index>(i)) = points_[i];
    mesh.edges.resize(2, static_cast<Eigen::Index>(edges_.size()));
    for (std::size_t i = 0; i < edges_.size(); ++i)
      mesh.edges.col(static_cast<Eigen::Index>(i)) = edges_[i];
    return mesh;
  }

 private:
  std::map<std::array<long, 3>, int> numbers_;
  std::vector<Eigen::Vector3d> points_;
  std::set<std::pair<int, int>> known_;
  std::vector<Eigen::Vector2i> edges_;
};

Eigen::Vector3d skew(double a, double b) { return {a + b / 2, b * std::sqrt(3) / 2, 0}; }

/// Triangles that touch at their corners, hexagons between them; three families of straight lines.
LineMesh kagome(int cells) {
  Drawing drawing;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const Eigen::Vector3d at = skew(2 * i, 2 * j);
      const Eigen::Vector3d right = at + skew(1, 0), up = at + skew(0, 1);
      drawing.line(at, right);
      drawing.line(right, up);
      drawing.line(up, at);
      drawing.line(at, at - skew(1, 0));
      drawing.line(at, at - skew(0, 1));
      drawing.line(right, right + skew(1, -1));
    }
  }
  return drawing.mesh();
}

/// Three segments at every joint, none straighter than another.
LineMesh honeycomb(int cells) {
  Drawing drawing;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const Eigen::Vector3d middle = std::sqrt(3) * skew(i, j);
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return middle + Eigen::Vector3d(std::sin(k * std::numbers::pi / 3),
                                        std::cos(k * std::numbers::pi / 3), 0);
      };
      for (int k = 0; k < 6; ++k) drawing.line(corner(k), corner(k + 1));
    }
  }
  return drawing.mesh();
}

/// Rows of alternating triangles of which only every other rung is there: joints of two to four.
LineMesh triangle_strip(int cells) {
  Drawing drawing;
  for (int i = 0; i < cells; ++i) {
    drawing.line(skew(i, 0), skew(i + 1, 0));
    drawing.line(skew(i, 1), skew(i + 1, 1));
    drawing.line(skew(i, 0), skew(i, 1));
    drawing.line(skew(i, 1), skew(i + 1, 0));
  }
  return drawing.mesh();
}

/// Rods along both diagonals of the cells of a band that is closed after some half turns.
LineMesh band(int cells, int rows, int half_turns) {
  Drawing drawing;
  const auto point = [&](double u, double v) -> Eigen::Vector3d {  // v in -1 .. 1
    const double along = 2 * std::numbers::pi * u / cells, turn = half_turns * along / 2;
    const double radius = 6 + v * std::cos(turn);
    return {radius * std::cos(along), radius * std::sin(along), v * std::sin(turn)};
  };
  for (int i = 0; i < cells; ++i) {
    for (int r = 0; r < rows; ++r) {
      const double low = -1 + 2.0 * r / rows, high = -1 + 2.0 * (r + 1) / rows;
      drawing.line(point(i, low), point(i + 1, low));
      if (r + 1 == rows) drawing.line(point(i, high), point(i + 1, high));
      drawing.line(point(i, low), point(i, high));
    }
  }
  return drawing.mesh();
}

/// A grid whose joints have moved so far that some have no clear straightest pair.
LineMesh disturbed_grid(int columns, int rows, double by, std::uint32_t seed) {
  LineMesh mesh = sheared_grid(columns, rows, 1.2);
  std::mt19937 random(seed);
  const auto number = [&] { return 2 * static_cast<double>(random()) / std::mt19937::max() - 1; };
  for (int v = 0; v < mesh.vertex_count(); ++v)
    mesh.vertices.col(v) += by * Eigen::Vector3d(number(), number(), 0.6 * number());
  return mesh;
}

/// The same lines under other numbers, some from their other end.
LineMesh renumbered(const LineMesh& mesh, std::uint32_t seed, std::vector<int>& vertices,
                    std::vector<int>& edges) {
  std::mt19937 random(seed);
  const auto shuffled = [&](int count) {
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t i = order.size(); i-- > 1;) std::swap(order[i], order[random() % (i + 1)]);
    return order;
  };
  vertices = shuffled(mesh.vertex_count());
  edges = shuffled(mesh.edge_count());
  LineMesh other = mesh;
  for (int v = 0; v < mesh.vertex_count(); ++v)
    other.vertices.col(vertices[v]) = mesh.vertices.col(v);
  for (int e = 0; e < mesh.edge_count(); ++e) {
    Eigen::Vector2i ends(vertices[mesh.edges(0, e)], vertices[mesh.edges(1, e)]);
    if (random() % 2 == 0) std::swap(ends[0], ends[1]);
    other.edges.col(edges[e]) = ends;
  }
  return other;
}

/// Each segment keeps its rod's letter, and at each joint at most two have either.
void expect_consistent(const LinkageGraph& graph) {
  std::vector<std::array<int, 2>> counts(graph.joints.size(), {0, 0});
  for (const Segment& segment : graph.segments) {
    if (segment.joints[0] >= 0 && segment.joints[1] >= 0) {
      EXPECT_EQ(segment.rods[0], segment.rods[1]);
    }
    for (const int end : {0, 1})
      if (segment.joints[end] >= 0) ++counts[segment.joints[end]][segment.rods[end]];
  }
  for (std::size_t j = 0; j < counts.size(); ++j) {
    EXPECT_LE(counts[j][0], 2);
    EXPECT_LE(counts[j][1], 2);
    EXPECT_EQ(counts[j][0] + counts[j][1], graph.joints[j].valence);
    EXPECT_TRUE(std::isfinite(graph.joints[j].opening_angle));
  }
}

std::string refusal(const LineMesh& mesh) {
  try {
    (void)build_linkage_graph(mesh);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Pairs of segments that are one rod at a joint.
std::set<std::pair<int, int>> rods_of(const LinkageGraph& graph, const std::vector<int>& numbers) {
  std::set<std::pair<int, int>> rods;
  for (const Joint& joint : graph.joints)
    for (const auto& rod : joint.segments)
      if (rod[0] >= 0 && rod[1] >= 0) rods.insert(std::minmax({numbers[rod[0]], numbers[rod[1]]}));
  return rods;
}

TEST(LinePatterns, OfEquallyStraightPairsThoseAreRodsThatMakeTwoFamilies) {
  for (const LineMesh& mesh : {honeycomb(2), honeycomb(6)}) {
    const LinkageGraph graph = build_linkage_graph(mesh);
    EXPECT_FALSE(graph.mixed_angles);
    expect_consistent(graph);
  }
}

/// Three families of straight lines: as drawn, though their angles are on no side of them.
TEST(LinePatterns, StraightLinesStayRodsThoughTheirAnglesAreMixed) {
  for (const int cells : {2, 5, 12}) {
    const LinkageGraph graph = build_linkage_graph(kagome(cells));
    EXPECT_TRUE(graph.mixed_angles);
    EXPECT_EQ(graph.bent_joints, 0);
    for (const Joint& joint : graph.joints) {
      EXPECT_NEAR(joint.normal.z(), 1, 1e-9);
      EXPECT_NEAR(joint.opening_angle, std::numbers::pi / 3, 1e-9);
      for (const auto& [behind, ahead] : joint.segments) {
        if (behind < 0 || ahead < 0) continue;
        const auto direction = [&](int s) -> Eigen::Vector3d {
          const auto& points = graph.segments[s].points;
          return (points[1] - points[0]).normalized();
        };
        EXPECT_NEAR(std::abs(direction(behind).dot(direction(ahead))), 1, 1e-9);
      }
    }
  }
}

TEST(LinePatterns, GridsWithMovedJointsKeepTheirTwoFamilies) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    for (const double by : {0.1, 0.2}) {
      const LinkageGraph graph = build_linkage_graph(disturbed_grid(12, 9, by, seed));
      EXPECT_FALSE(graph.mixed_angles) << seed << ' ' << by;
      expect_consistent(graph);
    }
  }
}

/// Where straight lines have become corners: rods that are nearly as straight as the straightest
/// make two families, or the straightest stay.
TEST(LinePatterns, RodsOfCrookedGridsAreNotLedAroundCorners) {
  int bent = 0, mixed = 0, refused = 0;
  for (std::uint32_t seed = 1; seed <= 24; ++seed) {
    for (const double by : {0.25, 0.3, 0.5}) {
      LinkageGraph graph;
      try {
        graph = build_linkage_graph(disturbed_grid(12, 9, by, seed));
      } catch (const Error& error) {
        // One grid in 72, whose cells stand on edge, has no side that can be told: it says so.
        ++refused;
        EXPECT_EQ(by, 0.5) << error.what();
        EXPECT_NE(std::string(error.what()).find("one side only"), std::string::npos);
        continue;
      }
      bent += graph.bent_joints;
      mixed += graph.mixed_angles ? 1 : 0;
      if (graph.mixed_angles) {
        EXPECT_EQ(graph.bent_joints, 0);
      } else {
        expect_consistent(graph);
      }
    }
  }
  EXPECT_LE(refused, 1);
  EXPECT_GT(bent, 0);
  EXPECT_GT(mixed, 10);
}

TEST(LinePatterns, AnotherOrderOfVerticesAndEdgesIsTheSameLinkage) {
  std::vector<LineMesh> meshes = {kagome(4),
                                  honeycomb(4),
                                  band(24, 3, 0),
                                  disturbed_grid(9, 7, 0.4, 5),
                                  disturbed_grid(9, 7, 0.5, 6),
                                  triangle_strip(9)};
  for (const LineMesh& mesh : meshes) {
    const LinkageGraph graph = build_linkage_graph(mesh);
    std::vector<int> vertices, edges, same(static_cast<std::size_t>(mesh.edge_count()));
    std::iota(same.begin(), same.end(), 0);
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const LinkageGraph other = build_linkage_graph(renumbered(mesh, seed, vertices, edges));
      EXPECT_EQ(rods_of(other, same), rods_of(graph, edges));
      EXPECT_EQ(other.bent_joints, graph.bent_joints);
      std::vector<const Joint*> by_vertex(static_cast<std::size_t>(mesh.vertex_count()), nullptr);
      for (const Joint& joint : other.joints) by_vertex[joint.vertex] = &joint;
      for (const Joint& joint : graph.joints) {
        const Joint& same_joint = *by_vertex[vertices[joint.vertex]];
        EXPECT_NEAR(std::abs(same_joint.normal.dot(joint.normal)), 1, 1e-9);
        EXPECT_NEAR(std::abs(std::sin(same_joint.opening_angle)),
                    std::abs(std::sin(joint.opening_angle)), 1e-9);
      }
    }
  }
}

TEST(LinePatterns, PublicModelsHaveTheSameRodsUnderOtherNumbers) {
  int tried = 0;
  for (const auto& known : known_linkages()) {
    if (!std::filesystem::exists(linkage_file(known.name))) continue;
    const LineMesh mesh = scene::read_line_mesh_file(linkage_file(known.name));
    const LinkageGraph graph = build_linkage_graph(mesh);
    EXPECT_EQ(graph.bent_joints, 0) << known.name;
    std::vector<int> vertices, edges, same(static_cast<std::size_t>(mesh.edge_count()));
    std::iota(same.begin(), same.end(), 0);
    const LinkageGraph other = build_linkage_graph(renumbered(mesh, 9, vertices, edges));
    EXPECT_EQ(rods_of(other, same), rods_of(graph, edges)) << known.name;
    ++tried;
  }
  if (tried == 0) GTEST_SKIP() << "no public models beside the project";
}

TEST(LinePatterns, BandsOfHalfTurnsHaveOneSideInAnyOrder) {
  std::vector<int> vertices, edges;
  for (const int half_turns : {0, 1, 2, 3}) {
    for (const int rows : {2, 4}) {
      const LineMesh mesh = band(30, rows, half_turns);
      for (std::uint32_t seed = 1; seed <= 6; ++seed) {
        const std::string message = refusal(renumbered(mesh, seed, vertices, edges));
        if (half_turns % 2 == 0) {
          EXPECT_EQ(message, "") << half_turns << " half turns, seed " << seed;
        } else {
          EXPECT_THAT(message, HasSubstr("has one side only: around the loop of the 30 joints"))
              << half_turns << " half turns, seed " << seed;
        }
      }
    }
  }
}

TEST(LinePatterns, AnOddRingOfHingesHasMixedAngles) {
  // A square of four joints with a triangle on one side, closed: five segments.
  Drawing drawing;
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(1, 1, 0), d(0, 1, 0), e(2, 0.5, 0);
  drawing.line(a, b);
  drawing.line(c, d);
  drawing.line(d, a);
  drawing.line(b, e);
  drawing.line(e, c);
  EXPECT_TRUE(build_linkage_graph(drawing.mesh()).mixed_angles);
  Drawing even;
  even.line(a, b);
  even.line(b, c);
  even.line(c, d);
  even.line(d, a);
  EXPECT_FALSE(build_linkage_graph(even.mesh()).mixed_angles);
}

}  // namespace
}  // namespace limber::rods
