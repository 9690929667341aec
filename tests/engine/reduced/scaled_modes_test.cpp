#include "engine/reduced/scaled_modes.h"

#include <gtest/gtest.h>

#include "engine/bodies/mesh_validation.h"
#include "engine/reduced/reduced_model.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::modes_of;

/// Two beams that share the edge at the end of the first, which may be held at its other end.
bodies::ElasticBody hinged_beams(bool held) {
  const bodies::ElasticBody beam = testing::block(6, 2, 2, 0.1, held);
  const int n = beam.mesh.node_count(), m = beam.mesh.tet_count();
  bodies::TetMesh mesh = beam.mesh;
  mesh.nodes.conservativeResize(3, 2 * n);
  mesh.nodes.rightCols(n) = beam.mesh.nodes.colwise() + Eigen::Vector3d(0.6, 0.2, 0);
  mesh.tets.conservativeResize(4, 2 * m);
  mesh.tets.rightCols(m) = beam.mesh.tets.array() + n;
  mesh.tet_material.assign(2 * m, 0);
  const bodies::PreparedMesh prepared =
      bodies::prepare_mesh(mesh, beam.fixed_nodes, {.merge_tolerance = 1e-9});
  bodies::ElasticBody body{prepared.mesh, {}};
  for (const int node : beam.fixed_nodes)
    body.fixed_nodes.push_back(prepared.compact_of_source[node]);
  return body;
}

TEST(ScaledModes, ReferenceModeIsTheFirstThatSomethingHolds) {
  EXPECT_EQ(0, reference_mode(5, 0, 0));
  EXPECT_EQ(6, reference_mode(10, 6, 0));
  EXPECT_EQ(8, reference_mode(10, 6, 2));
  EXPECT_EQ(6, reference_mode(8, 6, 2));
}

TEST(ScaledModes, ColumnOfTheReferenceMovesByOneBodyLength) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody beam = testing::block(6, 2, 2, 0.1, held);
    const bodies::ElasticBody hinged = hinged_beams(held);
    const ScaledModes one = modes_of(beam), two = modes_of(hinged);
    EXPECT_EQ(0, one.mechanism_count);
    ASSERT_EQ(1, two.mechanism_count);
    const int first = one.rigid_count;
    EXPECT_NEAR(beam.length(), largest_node_displacement(one.modes.col(first))[0], 1e-12);
    EXPECT_NEAR(hinged.length(), largest_node_displacement(two.modes.col(first + 1))[0], 1e-12);
    // The fold is neither frozen nor a hundred times everything else.
    const double fold = largest_node_displacement(two.modes.col(first))[0] / hinged.length();
    EXPECT_GT(fold, 0.2);
    EXPECT_LT(fold, 5);
    for (int k = first + 2; k < two.count(); ++k) {
      EXPECT_LT(largest_node_displacement(two.modes.col(k))[0], 2 * hinged.length());
    }
  }
}

TEST(ScaledModes, ModelOfABodyThatFolds) {
  const bodies::ElasticBody body = hinged_beams(true);
  ModelOptions options;
  options.mode_count = 8;
  options.tolerance = 0.05;
  const ReducedModel model = build_model(body, options);
  EXPECT_EQ(1, model.mechanism_count);
  EXPECT_LT(model.report.error_mean, options.tolerance);
  EXPECT_NE(std::string::npos, model.report.message.find("1 of 8 modes without stiffness"))
      << model.report.message;
}

}  // namespace
}  // namespace limber::reduced
