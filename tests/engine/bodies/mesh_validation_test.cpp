#include "engine/bodies/mesh_validation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/bodies/gradient_operator.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using ::testing::AllOf;
using testing::box_mesh;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TetMesh good_mesh() { return box_mesh({2, 2, 2}, {1, 1, 1}); }

void expect_refused(const TetMesh& mesh, ErrorCode code, const std::string& field,
                    const std::string& part, const std::vector<int>& fixed = {},
                    const MeshValidationOptions& options = {}) {
  try {
    (void)prepare_mesh(mesh, fixed, options);
    ADD_FAILURE() << "accepted, expected: " << part;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.field(), field) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(part));
  }
}

// Two boxes side by side in one mesh, the second one moved.
TetMesh two_boxes(const Eigen::Vector3d& offset) {
  const TetMesh one = good_mesh();
  TetMesh both = one;
  const int n = one.node_count(), m = one.tet_count();
  both.nodes.conservativeResize(3, 2 * n);
  both.nodes.rightCols(n) = one.nodes.colwise() + offset;
  both.tets.conservativeResize(4, 2 * m);
  both.tets.rightCols(m) = one.tets.array() + n;
  both.tet_material.assign(2 * m, 0);
  return both;
}

TEST(MeshValidation, AcceptsAGoodMeshAsItIs) {
  const TetMesh mesh = good_mesh();
  const PreparedMesh prepared = prepare_mesh(mesh, {});
  EXPECT_EQ(prepared.mesh.nodes, mesh.nodes);
  EXPECT_EQ(prepared.mesh.tets, mesh.tets);
  EXPECT_EQ(prepared.mesh.materials, mesh.materials);
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_THAT(prepared.repairs, IsEmpty());
  EXPECT_THAT(prepared.warnings, IsEmpty());
  for (int a = 0; a < mesh.node_count(); ++a) {
    EXPECT_EQ(prepared.compact_of_source[a], a);
    EXPECT_EQ(prepared.source_of_compact[a], a);
  }
}

TEST(MeshValidation, TurnsTetsOfNegativeOrientation) {
  TetMesh mesh = good_mesh();
  for (const int e : {3, 7, 8}) std::swap(mesh.tets(0, e), mesh.tets(1, e));
  const PreparedMesh prepared = prepare_mesh(mesh, {});
  EXPECT_THAT(prepared.repairs, ElementsAre(AllOf(HasSubstr("3 tets of negative orientation"),
                                                  HasSubstr("3, 7, 8"))));
  EXPECT_NEAR(GradientOperator(prepared.mesh).volumes().sum(), 1, 1e-14);
}

TEST(MeshValidation, LeavesOutUnusedNodes) {
  const TetMesh good = good_mesh();
  TetMesh mesh = good;
  mesh.nodes.resize(3, good.node_count() + 2);
  mesh.nodes << Eigen::Vector3d(9, 9, 9), good.nodes, Eigen::Vector3d(8, 8, 8);
  mesh.tets.array() += 1;
  const PreparedMesh prepared = prepare_mesh(mesh, {1, 2});
  EXPECT_EQ(prepared.mesh.nodes, good.nodes);
  EXPECT_EQ(prepared.mesh.tets, good.tets);
  EXPECT_EQ(prepared.compact_of_source.front(), -1);
  EXPECT_EQ(prepared.compact_of_source[1], 0);
  EXPECT_EQ(prepared.compact_of_source.back(), -1);
  EXPECT_EQ(prepared.source_of_compact[0], 1);
  EXPECT_THAT(prepared.repairs,
              ElementsAre(AllOf(HasSubstr("2 nodes that no tet uses"), HasSubstr(": 0, 28"))));
}

TEST(MeshValidation, MergesNearNodesOnlyOnRequest) {
  // Two boxes that share a side by position, up to 1e-7, but not by nodes.
  const TetMesh mesh = two_boxes({1 + 1e-7, 0, 0});
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.nodes[0]", "2 pieces");
  const PreparedMesh prepared = prepare_mesh(mesh, {}, {.merge_tolerance = 1e-6});
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_EQ(prepared.mesh.node_count(), 2 * 27 - 9);
  EXPECT_THAT(prepared.repairs, ElementsAre(HasSubstr("merged 9 nodes")));
  EXPECT_THAT(prepared.warnings, IsEmpty());
  // The left side of the second box stands for the right side of the first.
  EXPECT_EQ(prepared.compact_of_source[27], prepared.compact_of_source[2]);
  EXPECT_EQ(prepared.source_of_compact[prepared.compact_of_source[27]], 2);
  const TetMesh exact = two_boxes({1, 0, 0});
  EXPECT_EQ(prepare_mesh(exact, {}, {.merge_tolerance = 0}).piece_count, 1);
  EXPECT_EQ(prepare_mesh(mesh, {0, 1, 3, 27, 28, 30}, {.merge_tolerance = 0}).piece_count, 2);
}

TEST(MeshValidation, RefusesAMergeThatCollapsesTets) {
  expect_refused(good_mesh(), ErrorCode::kInvalidArgument, "mesh.tets[0]", "would collapse tet 0",
                 {}, {.merge_tolerance = 0.6});
}

TEST(MeshValidation, RefusesNonFiniteCoordinates) {
  TetMesh mesh = good_mesh();
  mesh.nodes(1, 13) = kNan;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.nodes[13]", "node 13");
  mesh.nodes(1, 13) = -std::numeric_limits<double>::infinity();
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.nodes[13]", "not finite");
}

TEST(MeshValidation, RefusesCoordinatesThatOverflow) {
  TetMesh mesh = good_mesh();
  mesh.nodes *= 1e150;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[0]", "too large");
  mesh.nodes *= 1e-280;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[0]", "no volume");
}

TEST(MeshValidation, RefusesNodeIndicesOutOfRange) {
  TetMesh mesh = good_mesh();
  mesh.tets(2, 17) = 27;
  expect_refused(mesh, ErrorCode::kOutOfRange, "mesh.tets[17]", "refers to node 27");
  mesh.tets(2, 17) = -1;
  expect_refused(mesh, ErrorCode::kOutOfRange, "mesh.tets[17]", "nodes 0 to 26");
}

TEST(MeshValidation, RefusesRepeatedNodes) {
  TetMesh mesh = good_mesh();
  mesh.tets(3, 5) = mesh.tets(0, 5);
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[5]", "twice");
}

TEST(MeshValidation, RefusesZeroVolume) {
  TetMesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  mesh.tets.resize(4, 1);
  mesh.tets << 0, 1, 2, 3;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[0]", "tet 0 has no volume");
  mesh.nodes(2, 3) = 1e-13;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[0]", "no volume");
  mesh.nodes(2, 3) = 1e-10;
  EXPECT_THAT(prepare_mesh(mesh, {}).warnings, ElementsAre(HasSubstr("poor shape")));
}

TEST(MeshValidation, RefusesTetsInvertedAgainstTheirNeighbours) {
  // Node 4 lies on the same side of face 1 2 3 as node 0: both volumes are positive once turned,
  // but they overlap.
  TetMesh mesh;
  mesh.nodes.resize(3, 5);
  mesh.nodes << 0, 1, 0, 0, 0.1, 0, 0, 1, 0, 0.1, 0, 0, 0, 1, 0.1;
  mesh.tets.resize(4, 2);
  mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[0]",
                 "tets 0 and 1 lie on the same side");
  mesh.nodes.col(4) = Eigen::Vector3d(1, 1, 1);
  EXPECT_EQ(prepare_mesh(mesh, {}).piece_count, 1);
}

TEST(MeshValidation, RefusesDuplicateTets) {
  TetMesh mesh = good_mesh();
  const int m = mesh.tet_count();
  mesh.tets.conservativeResize(4, m + 1);
  mesh.tets.col(m) = mesh.tets.col(4);
  mesh.tet_material.push_back(0);
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tets[4]", "tets 4 and 48");
}

TEST(MeshValidation, RefusesAPieceWithoutFixedNodes) {
  const TetMesh mesh = two_boxes({3, 0, 0});
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.nodes[0]", "that of node 0");
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.nodes[27]", "that of node 27",
                 {0, 1, 3, 9});
  const PreparedMesh prepared = prepare_mesh(mesh, {0, 1, 3, 27, 28, 30});
  EXPECT_EQ(prepared.piece_count, 2);
  EXPECT_THAT(prepared.warnings, IsEmpty());
}

TEST(MeshValidation, RefusesBadFixedNodes) {
  TetMesh mesh = good_mesh();
  expect_refused(mesh, ErrorCode::kOutOfRange, "fixed_nodes[1]", "fixed node 27", {0, 27});
  expect_refused(mesh, ErrorCode::kOutOfRange, "fixed_nodes[0]", "fixed node -1", {-1});
  mesh.nodes.conservativeResize(3, 28);
  mesh.nodes.col(27).setZero();
  expect_refused(mesh, ErrorCode::kInvalidArgument, "fixed_nodes[2]", "belongs to no tet",
                 {0, 1, 27});
}

TEST(MeshValidation, RefusesBadMaterials) {
  TetMesh mesh = good_mesh();
  mesh.materials = {{1e6, 0.3, 1000}, {1e6, 0.5, 1000}};
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.materials[1].poissons_ratio",
                 "(-1, 0.5)");
  mesh.materials[1] = {0, 0.3, 1000};
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.materials[1].youngs_modulus", "> 0");
  mesh.materials[1] = {1e6, 0.3, kNan};
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.materials[1].density", "> 0");
  mesh.materials.pop_back();
  mesh.tet_material[9] = 1;
  expect_refused(mesh, ErrorCode::kOutOfRange, "mesh.tet_material[9]", "material 1");
  mesh.tet_material.pop_back();
  expect_refused(mesh, ErrorCode::kInvalidArgument, "mesh.tet_material", "48 entries, not 47");
  mesh.tet_material.clear();
  mesh.materials.clear();
  EXPECT_EQ(prepare_mesh(mesh, {}).piece_count, 1);
}

TEST(MeshValidation, RefusesEmptyMeshes) {
  expect_refused(TetMesh{}, ErrorCode::kInvalidArgument, "mesh.tets", "no tets");
}

TEST(MeshValidation, RefusesBadOptions) {
  expect_refused(good_mesh(), ErrorCode::kInvalidArgument, "merge_tolerance", ">= 0", {},
                 {.merge_tolerance = -1.0});
  expect_refused(good_mesh(), ErrorCode::kInvalidArgument, "merge_tolerance", "finite", {},
                 {.merge_tolerance = kNan});
  expect_refused(good_mesh(), ErrorCode::kInvalidArgument, "relative_zero_volume", "[0, 1e-3]", {},
                 {.merge_tolerance = {}, .relative_zero_volume = kNan});
}

TEST(MeshValidation, WarnsOfPartsThatTouchAlongAnEdge) {
  // Diagonal neighbours share the edge x = y = 1 of nodes 8, 17, 26.
  const TetMesh mesh = two_boxes({1, 1, 0});
  const PreparedMesh prepared = prepare_mesh(mesh, {}, {.merge_tolerance = 1e-9});
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_THAT(prepared.warnings,
              ElementsAre(AllOf(HasSubstr("only along 2 edges"), HasSubstr("nodes 8 and 17"),
                                HasSubstr("fold"))));
}

TEST(MeshValidation, WarnsOfPartsThatTouchAtANode) {
  const PreparedMesh prepared = prepare_mesh(two_boxes({1, 1, 1}), {}, {.merge_tolerance = 1e-9});
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_THAT(prepared.warnings,
              ElementsAre(AllOf(HasSubstr("only at 1 node"), HasSubstr(": 26"))));
}

TEST(MeshValidation, WarnsOfPoorTetsAndNamesTheWorst) {
  TetMesh mesh = good_mesh();
  mesh.nodes.row(2) *= 1e-5;
  const PreparedMesh prepared = prepare_mesh(mesh, {});
  EXPECT_THAT(prepared.warnings, ElementsAre(AllOf(HasSubstr("48 tets of poor shape"),
                                                   HasSubstr("the worst is tet"))));
}

TEST(MeshValidation, WarnsOfAPieceThatCanSwing) {
  EXPECT_THAT(prepare_mesh(good_mesh(), {4}).warnings, ElementsAre(HasSubstr("at one node")));
  EXPECT_THAT(prepare_mesh(good_mesh(), {0, 2, 1}).warnings,
              ElementsAre(HasSubstr("along a line")));
  EXPECT_THAT(prepare_mesh(good_mesh(), {0, 2, 4}).warnings, IsEmpty());
}

TEST(MeshValidation, LongListsAreCutShort) {
  TetMesh mesh = good_mesh();
  for (int e = 0; e < 30; ++e) std::swap(mesh.tets(0, e), mesh.tets(1, e));
  EXPECT_THAT(prepare_mesh(mesh, {}).repairs, ElementsAre(HasSubstr(": 0, 1, 2, 3, 4, ...")));
}

TEST(MeshValidation, LargeMeshesTakeNoQuadraticTime) {
  // 384,000 tets with every node present twice; a quadratic search would take hours.
  TetMesh mesh = box_mesh({40, 40, 40}, {1, 1, 1});
  const int n = mesh.node_count();
  mesh.nodes.conservativeResize(3, 2 * n);
  mesh.nodes.rightCols(n) = mesh.nodes.leftCols(n);
  for (int e = 1; e < mesh.tet_count(); e += 2) mesh.tets.col(e).array() += n;
  const PreparedMesh prepared = prepare_mesh(mesh, {}, {.merge_tolerance = 1e-9});
  EXPECT_EQ(prepared.mesh.node_count(), n);
  EXPECT_EQ(prepared.piece_count, 1);
}

}  // namespace
}  // namespace limber::bodies
