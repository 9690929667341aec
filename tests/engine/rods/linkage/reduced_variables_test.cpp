#include "engine/rods/linkage/reduced_variables.h"

#include <gtest/gtest.h>

#include <vector>

#include "engine/base/error.h"
#include "engine/rods/linkage/rest_lengths.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using testing::known_linkages;
using testing::KnownLinkage;
using testing::linkage_file;
using testing::sheared_grid;

/// A free rod, a rod from a joint to a free end, one from a free end to a joint, one between
/// joints.
LineMesh rods_of_every_kind() {
  LineMesh mesh;
  mesh.vertices.resize(3, 8);
  mesh.vertices << 0, 1, 2, 0, 1, 5, 6, 2,  //
      0, 0, 0.5, 1, 1, 0, 0, 3,             //
      0, 0, 0, 0, 0, 0, 0, 0;
  mesh.edges.resize(2, 5);
  mesh.edges << 0, 1, 3, 5, 7,  //
      1, 2, 0, 6, 1;
  return mesh;
}

TEST(ReducedVariables, EveryUnknownIsFoundOnceAndInOrder) {
  const LinkageGraph graph = build_linkage_graph(rods_of_every_kind());
  const ReducedVariables variables(graph, {4, 3, 2, 1, 5});
  int next = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    EXPECT_EQ(variables.chain_begin(s), next);
    const bool at_start = graph.segments[s].joints[0] >= 0;
    const bool at_finish = graph.segments[s].joints[1] >= 0;
    const int n = variables.edges(s);
    for (int i = 0; i <= n; ++i) {
      const bool moved = (at_start && i < 2) || (at_finish && i > n - 2);
      EXPECT_EQ(variables.position(s, i), moved ? -1 : next) << s << " " << i;
      if (!moved) next += 3;
      if (i == n) break;
      const bool turned = (at_start && i == 0) || (at_finish && i == n - 1);
      EXPECT_EQ(variables.angle(s, i), turned ? -1 : next) << s << " " << i;
      if (!turned) next += 1;
    }
    EXPECT_EQ(variables.chain_begin(s) + variables.chain_size(s), next);
  }
  for (int j = 0; j < variables.joints(); ++j) {
    EXPECT_EQ(variables.joint_begin(j), next);
    next += 9;
  }
  EXPECT_EQ(variables.size(), next);
}

TEST(ReducedVariables, CountsAreThoseOfThePublicCode) {
  if (!std::filesystem::exists(linkage_file("burd_flat_opt_scaled"))) GTEST_SKIP() << "no data";
  for (const KnownLinkage& known : known_linkages()) {
    if (known.unknowns == 0) continue;
    const LinkageGraph graph =
        build_linkage_graph(scene::read_line_mesh_file(linkage_file(known.name)));
    EXPECT_EQ(ReducedVariables(graph, known.edges_per_segment).size(), known.unknowns)
        << known.name;
  }
}

TEST(ReducedVariables, MoreUnknownsThanCanBeCountedNameTheSegment) {
  const LinkageGraph graph = build_linkage_graph(rods_of_every_kind());
  try {
    (void)ReducedVariables(graph, 200'000'000);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
    EXPECT_EQ(error.field(), "edges_per_segment[2]");
  }
}

TEST(ReducedVariables, TooFewEdgesNameTheSegment) {
  const LinkageGraph graph = build_linkage_graph(rods_of_every_kind());
  const auto field = [&](std::vector<int> edges) {
    try {
      (void)ReducedVariables(graph, std::move(edges));
    } catch (const Error& error) {
      return error.field();
    }
    return std::string();
  };
  EXPECT_EQ(field({3, 2, 2, 1, 2}), "");
  EXPECT_EQ(field({2, 2, 2, 1, 2}), "edges_per_segment[0]");
  EXPECT_EQ(field({3, 1, 2, 1, 2}), "edges_per_segment[1]");
  EXPECT_EQ(field({3, 2, 2, 0, 2}), "edges_per_segment[3]");
  EXPECT_EQ(field({3, 2}), "edges_per_segment");
}

TEST(RestLengths, AddUpToTheSegmentsFromJointToJoint) {
  const LineMesh mesh = rods_of_every_kind();
  const LinkageGraph graph = build_linkage_graph(mesh);
  const ReducedVariables variables(graph, {7, 5, 4, 3, 6});
  const RestLengths rest = distribute_rest_lengths(graph, variables, drawn_lengths(graph));
  for (int s = 0; s < variables.segments(); ++s) {
    double length = 0;
    for (int e = 0; e < variables.edges(s); ++e) {
      const double edge = rest.edge(graph, variables, s, e);
      EXPECT_GT(edge, 0);
      const bool terminal = (e == 0 && graph.segments[s].joints[0] >= 0) ||
                            (e == variables.edges(s) - 1 && graph.segments[s].joints[1] >= 0);
      length += terminal ? edge / 2 : edge;
    }
    EXPECT_NEAR(length, graph.segments[s].length, 1e-14);
  }
}

TEST(RestLengths, TerminalEdgesTakeTheShorterOfTheirSegments) {
  LineMesh mesh = sheared_grid(3, 3, 1.2);
  for (int v = 0; v < 9; ++v)
    mesh.vertices(0, v) += v % 3 == 2 ? 0.7 : 0;  // the last column is wider
  const LinkageGraph graph = build_linkage_graph(mesh);
  const ReducedVariables variables(graph, 10);
  const RestLengths rest = distribute_rest_lengths(graph, variables, drawn_lengths(graph));
  int shorter = 0;
  for (std::size_t j = 0; j < graph.joints.size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const std::array<int, 2>& pair = graph.joints[j].segments[rod];
      double least = 1e9;
      for (const int s : pair) {
        if (s >= 0) least = std::min(least, graph.segments[s].length / 9);
      }
      EXPECT_DOUBLE_EQ(rest.terminal(rod, static_cast<Eigen::Index>(j)), least);
      if (pair[0] >= 0 && pair[1] >= 0) ++shorter;
    }
  }
  EXPECT_GT(shorter, 0);
  Eigen::VectorXd bad = drawn_lengths(graph);
  bad[3] = 0;
  EXPECT_THROW((void)distribute_rest_lengths(graph, variables, bad), Error);
}

}  // namespace
}  // namespace limber::rods
