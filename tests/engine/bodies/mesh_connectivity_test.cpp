#include "engine/bodies/mesh_connectivity.h"

#include <gtest/gtest.h>

#include "engine/bodies/tet_faces.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

TetNodes tets_of(std::initializer_list<Eigen::Vector4i> list) {
  TetNodes tets(4, static_cast<Eigen::Index>(list.size()));
  Eigen::Index e = 0;
  for (const Eigen::Vector4i& tet : list) tets.col(e++) = tet;
  return tets;
}

TEST(MeshConnectivity, SharedFacesHaveOppositeOrder) {
  const TetMesh mesh = testing::box_mesh({2, 2, 2}, {1, 1, 1});
  const std::vector<TetFace> faces = sorted_faces(mesh.tets);
  ASSERT_EQ(faces.size(), 4u * 48);
  int pairs = 0;
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].nodes != faces[i - 1].nodes) continue;
    ++pairs;
    EXPECT_NE(faces[i].even, faces[i - 1].even);
  }
  EXPECT_EQ(2 * pairs + 2 * 6 * 4, 4 * 48) << "all but the boundary";
  EXPECT_FALSE(overlapping_neighbours(faces));
  EXPECT_EQ(face_connected_parts(mesh.tets, faces).count, 1);
}

TEST(MeshConnectivity, PartsAndPieces) {
  // 0 and 1 share a face, 2 shares an edge with 1, 3 a node with 2, 4 nothing.
  const TetNodes tets =
      tets_of({{0, 1, 2, 3}, {1, 3, 2, 4}, {3, 4, 5, 6}, {6, 7, 8, 9}, {10, 11, 12, 13}});
  const Grouping parts = face_connected_parts(tets, sorted_faces(tets));
  EXPECT_EQ(parts.group_of, (std::vector<int>{0, 0, 1, 2, 3}));
  EXPECT_EQ(parts.count, 4);
  const Grouping pieces = node_connected_pieces(tets, 14);
  EXPECT_EQ(pieces.count, 2);
  EXPECT_EQ(pieces.group_of[9], 0);
  EXPECT_EQ(pieces.group_of[10], 1);
  const WeakContacts contacts = weak_contacts(tets, 14, parts);
  EXPECT_EQ(contacts.edges, (std::vector<std::pair<int, int>>{{3, 4}}));
  EXPECT_EQ(contacts.nodes, std::vector<int>{6});
}

TEST(MeshConnectivity, OverlapsOfTwoAndThreeTetsOnAFace) {
  // Positive tets of nodes 0 1 2 and an apex: apexes on both sides are fine, two on one side are
  // not.
  const Eigen::Vector4i above(0, 1, 2, 3), below(0, 2, 1, 4), above_too(0, 1, 2, 5);
  EXPECT_FALSE(overlapping_neighbours(sorted_faces(tets_of({above, below}))));
  EXPECT_EQ(overlapping_neighbours(sorted_faces(tets_of({above, above_too}))),
            std::make_pair(0, 1));
  EXPECT_EQ(overlapping_neighbours(sorted_faces(tets_of({above, below, above_too}))),
            std::make_pair(0, 2));
}

}  // namespace
}  // namespace limber::bodies
