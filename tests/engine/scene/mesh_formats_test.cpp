#include "engine/scene/formats/mesh_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

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

/// The mesh of data/README.md, made independently of any file.
bodies::TetMesh twelve_tets() {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, 12);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 2; ++j) {
      for (int k = 0; k < 2; ++k)
        mesh.nodes.col((2 * i + j) * 2 + k) << 0.5 * i, 0.75 * j + 0.1 * i, 1.25 * k;
    }
  }
  mesh.tets.resize(4, 12);
  mesh.tets.transpose() << 0, 4, 6, 7, 0, 2, 3, 7, 0, 1, 5, 7, 0, 4, 7, 5, 0, 1, 7, 3, 0, 2, 7, 6,
      4, 8, 10, 11, 4, 6, 7, 11, 4, 5, 9, 11, 4, 8, 11, 9, 4, 5, 11, 7, 4, 6, 11, 10;
  return mesh;
}

class Fixtures : public ::testing::TestWithParam<const char*> {};

TEST_P(Fixtures, AreReadToTheLastBit) {
  const MeshReading reading = read_mesh_file(testing::fixture(GetParam()));
  const bodies::TetMesh expected = twelve_tets();
  const bool quadratic = std::string(GetParam()).find("quadratic") == 0;
  ASSERT_GE(reading.mesh.node_count(), 12);
  if (!quadratic) {
    EXPECT_EQ(reading.mesh.node_count(), 12);
  }
  EXPECT_LT((reading.mesh.nodes.leftCols(12) - expected.nodes).norm(), 1e-15);
  ASSERT_EQ(reading.mesh.tet_count(), 12);
  EXPECT_EQ(reading.mesh.tets, expected.tets);
  EXPECT_TRUE(reading.mesh.materials.empty());
  const bool has_triangles =
      std::string(GetParam()).find("tetgen") != 0 && std::string(GetParam()).find("gmsh_4") != 0;
  ASSERT_EQ(reading.warnings.size(), has_triangles || quadratic ? 1 : 0);
  if (quadratic) {
    EXPECT_THAT(reading.warnings[0], HasSubstr("12 tetrahedra of higher order"));
  } else if (has_triangles) {
    EXPECT_THAT(reading.warnings[0], HasSubstr("2 cells that are no tetrahedra"));
  }
}

INSTANTIATE_TEST_SUITE_P(Meshio, Fixtures,
                         ::testing::Values("gmsh_2_ascii.msh", "gmsh_2_binary.msh",
                                           "gmsh_4_ascii.msh", "gmsh_4_binary.msh", "medit.mesh",
                                           "tetgen.node", "tetgen.ele", "vtk_4_ascii.vtk",
                                           "vtk_4_binary.vtk", "vtk_5_ascii.vtk",
                                           "vtk_5_binary.vtk", "vtu_ascii.vtu", "vtu_binary.vtu",
                                           "vtu_zlib.vtu", "abaqus.inp", "quadratic.msh",
                                           "quadratic.vtu", "quadratic.inp"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST(MeshFormats, TheContentIsTrustedMoreThanTheName) {
  const std::string bytes = read_bytes(testing::fixture("gmsh_4_binary.msh"));
  EXPECT_EQ(read_mesh({"upload.bin", bytes, {}}).mesh.tet_count(), 12);
  EXPECT_EQ(read_mesh({"upload.vtu", bytes, {}}).mesh.tet_count(), 12);
}

constexpr const char* kMedit =
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
    "Triangles\n0\nTetrahedra\n1\n1 2 3 4 0\nEnd\n";

TEST(MeshFormats, EmptySectionsOfOtherCellsAreNotWarnedOf) {
  const MeshReading reading = read_mesh({"a.mesh", kMedit, {}});
  EXPECT_EQ(reading.mesh.tet_count(), 1);
  EXPECT_TRUE(reading.warnings.empty()) << reading.warnings.front();
}

TEST(MeshFormats, AByteOrderMarkIsSkipped) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(read_mesh({"a.mesh", mark + kMedit, {}}).mesh.tet_count(), 1);
  const std::string vtk =
      mark +
      "# vtk DataFile Version 3.0\na tet\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
      "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  EXPECT_EQ(read_mesh({"a.vtk", vtk, {}}).mesh.tet_count(), 1);
  const MeshFileSet pair{"a.node",
                         mark + "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n",
                         {{"a.ele", mark + "1 4 0\n0 0 1 2 3\n"}}};
  EXPECT_EQ(read_mesh(pair).mesh.tet_count(), 1);
}

TEST(MeshFormats, BigEndianGmshIsRead) {
  std::string text = "$MeshFormat\n2.2 1 8\n";
  const auto put = [&text](auto value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    text.append(std::make_reverse_iterator(raw + sizeof value), std::make_reverse_iterator(raw));
  };
  put(std::int32_t{1});
  text += "\n$EndMeshFormat\n$Nodes\n4\n";
  for (std::int32_t i = 0; i < 4; ++i) {
    put(i + 10);
    for (int axis = 0; axis < 3; ++axis) put(i == axis + 1 ? 2.5 : 0.0);
  }
  text += "\n$EndNodes\n$Elements\n1\n";
  for (const std::int32_t value : {4, 1, 2, 1, 7, 7, 10, 11, 12, 13}) put(value);
  text += "\n$EndElements\n";
  const MeshReading reading = read_mesh({"big.msh", text, {}});
  EXPECT_EQ(reading.mesh.tets.col(0), Eigen::Vector4i(0, 1, 2, 3));
  EXPECT_EQ(reading.mesh.nodes(2, 3), 2.5);
}

TEST(MeshFormats, GmshBlocksOfSeveralEntitiesAreJoined) {
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
      "$Nodes\n2 5 1 90\n2 1 1 2\n90\n3\n0 0 0 0.1 0.2\n1 0 0 0.3 0.4\n3 1 0 3\n1\n2\n7\n0 1 0\n0 "
      "0 1\n1 1 1\n"
      "$EndNodes\n$Elements\n2 3 1 3\n2 1 2 1\n1 90 3 1\n3 1 4 2\n2 90 3 1 2\n3 3 1 2 "
      "7\n$EndElements\n";
  const MeshReading reading = read_mesh({"blocks.msh", text, {}});
  EXPECT_EQ(reading.mesh.node_count(), 5);
  EXPECT_EQ(reading.mesh.tets.col(0), Eigen::Vector4i(0, 1, 2, 3));
  EXPECT_EQ(reading.mesh.tets.col(1), Eigen::Vector4i(1, 2, 3, 4));
}

TEST(MeshFormats, AbaqusIsReadWithCommentsCasesAndOtherElements) {
  const std::string text =
      "*Heading\n a title, 1, 2\n** a comment\n*node, nset=all\n** another\n 7, 0., 0., 0.\n 8, "
      "1., 0., 0.\n"
      "9, 0., 1., 0.\n10, 0., 0., +1.\n*Element, type=c3d4h, elset=a\n 1, 7, 8, 9, 10\n"
      "*ELEMENT, TYPE=C3D8\n 2, 7, 8, 9, 10, 7, 8,\n 9, 10\n*NODE OUTPUT\n U\n*ELSET, ELSET=b, "
      "GENERATE\n 1, 1, 1\n";
  const MeshReading reading = read_mesh({"model.INP", text, {}});
  EXPECT_EQ(reading.mesh.node_count(), 4);
  EXPECT_EQ(reading.mesh.tet_count(), 1);
  ASSERT_EQ(reading.warnings.size(), 1);
  EXPECT_THAT(reading.warnings[0], HasSubstr("1 cells that are no tetrahedra are ignored (c3d8)"));
}

TEST(MeshFormats, VegaRegionsGiveMaterials) {
  const std::string vega =
      "# c\n*VERTICES\n5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n*ELEMENTS\nTET\n2 4 "
      "0\n1 1 2 3 4\n"
      "2 2 3 4 5\n*SET left\n*INCLUDE left.txt\n*MATERIAL soft\nENU, 900, 5e4, 0.3\n*MATERIAL "
      "hard\nENU, 1000, 2e7, 0.4\n"
      "*REGION\nallElements, soft\n*REGION\nleft, hard\n";
  const MeshReading whole = read_mesh({"a.veg", vega, {{"left.txt", "1,\n"}}});
  ASSERT_EQ(whole.mesh.materials.size(), 2);
  EXPECT_TRUE(whole.warnings.empty());
  const auto of = [](const MeshReading& reading, std::size_t tet) {
    return reading.mesh.materials[static_cast<std::size_t>(reading.mesh.tet_material[tet])];
  };
  EXPECT_EQ(of(whole, 0), (bodies::Material{2e7, 0.4, 1000}));
  EXPECT_EQ(of(whole, 1), (bodies::Material{5e4, 0.3, 900}));

  const MeshReading lacking = read_mesh({"a.veg", vega, {}});
  EXPECT_EQ(of(lacking, 0), (bodies::Material{5e4, 0.3, 900}));
  ASSERT_EQ(lacking.warnings.size(), 1);
  EXPECT_THAT(lacking.warnings[0], HasSubstr("'left.txt' (*INCLUDE in line 15) is not there"));
}

TEST(MeshFormats, TurtleWithoutItsListsHasNoMaterialsAndSaysSo) {
  const std::filesystem::path path = testing::shared_body("turtle-volumetric-heterogeneous.veg");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const MeshReading reading = read_mesh_file(path);
  EXPECT_TRUE(reading.mesh.materials.empty());
  ASSERT_EQ(reading.warnings.size(), 3);
  EXPECT_THAT(reading.warnings[0], HasSubstr("'shellElementList.txt'"));
  EXPECT_THAT(reading.warnings[1], HasSubstr("'nonShellElementList.txt'"));
  EXPECT_THAT(reading.warnings[2], HasSubstr("the scene's material applies"));
}

TEST(MeshFormats, VegaIncludesAreLookedForBesideTheFileOnly) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "limber_vega";
  std::filesystem::create_directories(folder / "inner");
  std::ofstream(folder / "outside.txt") << "1\n";
  std::ofstream(folder / "inner" / "a.veg")
      << "*VERTICES\n4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n*ELEMENTS\nTET\n1 4 0\n0 0 1 2 "
         "3\n*SET s\n"
         "*INCLUDE ../outside.txt\n*MATERIAL m\nENU, 1, 1, 0.1\n*REGION\ns, m\n";
  const MeshReading reading = read_mesh_file(folder / "inner" / "a.veg");
  EXPECT_TRUE(reading.mesh.materials.empty());
  ASSERT_FALSE(reading.warnings.empty());
  EXPECT_THAT(reading.warnings[0], HasSubstr("'outside.txt'"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace limber::scene
