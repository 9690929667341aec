#include "engine/scene/mesh_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "engine/base/error.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

struct KnownBody {
  const char* file;
  int tets;
  int nodes;  // 0: not stated in the index
};

std::ostream& operator<<(std::ostream& out, const KnownBody& body) { return out << body.file; }

class SharedBodies : public ::testing::TestWithParam<KnownBody> {};

TEST_P(SharedBodies, AreReadWithTheCountsOfTheIndex) {
  const std::filesystem::path path = testing::shared_body(GetParam().file);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const MeshReading reading = read_mesh_file(path);
  const bodies::TetMesh& mesh = reading.mesh;
  EXPECT_EQ(mesh.tet_count(), GetParam().tets);
  if (GetParam().nodes > 0) {
    EXPECT_EQ(mesh.node_count(), GetParam().nodes);
  }
  EXPECT_TRUE(mesh.nodes.allFinite());
  EXPECT_GE(mesh.tets.minCoeff(), 0);
  EXPECT_LT(mesh.tets.maxCoeff(), mesh.node_count());
  // No tet of these files is flat: ids resolved wrongly would show here.
  const double size =
      (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).maxCoeff();
  double total = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    Eigen::Matrix3d edges;
    for (int c = 0; c < 3; ++c)
      edges.col(c) = mesh.nodes.col(mesh.tets(c + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
    total += std::abs(edges.determinant()) / 6;
  }
  // Tets that do not overlap fill at most their bounding box.
  const Eigen::Vector3d box = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
  EXPECT_GT(total, 1e-3 * box.prod()) << "size " << size;
  EXPECT_LT(total, 1.0000001 * box.prod());
}

INSTANTIATE_TEST_SUITE_P(
    Index, SharedBodies,
    ::testing::Values(
        KnownBody{"beam/mesh.abq", 6144, 1377}, KnownBody{"dino/mesh.abq", 5249, 1493},
        KnownBody{"tyrannosaurus/mesh.abq", 6658, 2398}, KnownBody{"fish.abq", 3477, 0},
        KnownBody{"mushroom.abq", 2388, 0}, KnownBody{"beam-fine.abq", 74112, 0},
        KnownBody{"octopus.abq", 13403, 4164}, KnownBody{"bunny.msh", 19379, 4670},
        KnownBody{"Armadillo13K.msh", 54985, 13230}, KnownBody{"dolphin5K.msh", 36304, 8111},
        KnownBody{"liver.msh", 596, 181}, KnownBody{"raptorTetra_8418.vtu", 8418, 2996},
        KnownBody{"ditto.vtk", 10415, 2580}, KnownBody{"frog.mesh", 5389, 1749},
        KnownBody{"cactus_test_3.node", 8993, 2431}, KnownBody{"cactus_test_3.ele", 8993, 2431},
        KnownBody{"turtle-volumetric-heterogeneous.veg", 1185, 347}),
    [](const auto& test) {
      std::string name = test.param.file;
      for (char& c : name) {
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
      }
      return name;
    });

}  // namespace
}  // namespace limber::scene
