// Every reader, on every prefix and on damaged copies of small valid files: an Error or a success,
// nothing else.
#include <gtest/gtest.h>

#include <random>

#include "engine/base/error.h"
#include "engine/scene/formats/material_files.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/point_cache.h"
#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/formats/vtu_series.h"
#include "tests/engine/scene/glb_files.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using Reader = std::function<void(const std::string&)>;

struct Counts {
  int read = 0, refused = 0;
};

void attempt(const Reader& reader, const std::string& content, Counts& counts) {
  try {
    reader(content);
    ++counts.read;
  } catch (const Error& error) {
    EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
    EXPECT_STRNE(error.what(), "");
    ++counts.refused;
  }
}

void torment(const Reader& reader, const std::string& valid) {
  Counts counts;
  attempt(reader, valid, counts);
  ASSERT_EQ(counts.read, 1) << "the file itself must be read";
  const std::size_t step = std::max<std::size_t>(1, valid.size() / 1500);
  for (std::size_t size = 0; size < valid.size(); size += step)
    attempt(reader, valid.substr(0, size), counts);
  std::mt19937_64 random(20261121);
  for (int round = 0; round < 2500; ++round) {
    std::string damaged = valid;
    const int damages = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < damages; ++i) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0:
          damaged[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random() % 8)));
          break;
        case 2:
          damaged[at] = "0123456789-.eE$*<> \n"[random() % 20];
          break;
        default:
          damaged.erase(at, 1 + random() % 8);
      }
      if (damaged.empty()) damaged.push_back('x');
    }
    attempt(reader, damaged, counts);
  }
  EXPECT_GT(counts.refused, 100);
}

class DamagedMeshes : public ::testing::TestWithParam<const char*> {};

TEST_P(DamagedMeshes, AreReadOrRefused) {
  const std::string name = GetParam();
  MeshFileSet files;
  files.name = name;
  if (name == "tetgen.node")
    files.companions["tetgen.ele"] = read_bytes(testing::fixture("tetgen.ele"));
  if (name == "tetgen.ele")
    files.companions["tetgen.node"] = read_bytes(testing::fixture("tetgen.node"));
  torment(
      [&](const std::string& content) {
        files.content = content;
        const MeshReading reading = read_mesh(files);
        // What is read must be sound enough to be looked at.
        ASSERT_TRUE(reading.mesh.nodes.allFinite());
        ASSERT_GE(reading.mesh.tets.minCoeff(), 0);
        ASSERT_LT(reading.mesh.tets.maxCoeff(), reading.mesh.node_count());
      },
      read_bytes(testing::fixture(name)));
}

INSTANTIATE_TEST_SUITE_P(Fixtures, DamagedMeshes,
                         ::testing::Values("gmsh_2_ascii.msh", "gmsh_2_binary.msh",
                                           "gmsh_4_ascii.msh", "gmsh_4_binary.msh", "medit.mesh",
                                           "tetgen.node", "tetgen.ele", "vtk_4_ascii.vtk",
                                           "vtk_4_binary.vtk", "vtk_5_ascii.vtk",
                                           "vtk_5_binary.vtk", "vtu_ascii.vtu", "vtu_binary.vtu",
                                           "vtu_zlib.vtu", "abaqus.inp"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

bodies::TetMesh fixture_mesh() { return read_mesh_file(testing::fixture("abaqus.inp")).mesh; }

TEST(DamagedFiles, AppendedVtu) {
  bodies::TetMesh mesh = fixture_mesh();
  torment(
      [](const std::string& content) {
        static_cast<void>(read_mesh({"a.vtu", content, {}}));
      },
      write_vtu(mesh));
}

TEST(DamagedFiles, Gmsh1) {
  torment(
      [](const std::string& content) {
        static_cast<void>(read_mesh({"a.msh", content, {}}));
      },
      "$NOD\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$ENDNOD\n$ELM\n3\n1 4 1 1 4 1 2 3 "
      "4\n2 4 1 1 4 2 3 4 5\n"
      "3 2 1 1 3 1 2 3\n$ENDELM\n");
}

TEST(DamagedFiles, Vega) {
  torment(
      [](const std::string& content) {
        static_cast<void>(read_mesh({"a.veg", content, {{"l.txt", "1, 2"}}}));
      },
      "*VERTICES\n5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n*ELEMENTS\nTET\n2 4 0\n1 1 "
      "2 3 4\n2 2 3 4 5\n"
      "*SET left\n*INCLUDE l.txt\n*MATERIAL soft\nENU, 900, 5e4, 0.3\n*REGION\nleft, soft\n");
}

TEST(DamagedFiles, Materials) {
  const MeshReading mesh{fixture_mesh(), {}, {}};
  torment(
      [&](const std::string& content) {
        MeshReading copy = mesh;
        read_materials("a.elastic", content, copy);
      },
      "*groups 2\n\n*MATERIAL, NAME=GROUP_0\n*ELASTIC\n7e+06, 0.45\n*DENSITY 100\n*num_of_tets "
      "3\n\n*MATERIAL, NAME=GROUP_1\n"
      "*ELASTIC\n5e+04, 0.45\n*DENSITY 100\n*num_of_tets 9\n*ELSET, ELSET=GROUP_0\n0, 1, "
      "2\n*ELSET, ELSET=GROUP_1\n3, 4, 5, "
      "6, 7, 8, 9, 10, 11\n");
}

TEST(DamagedFiles, FixedNodes) {
  torment(
      [](const std::string& content) { static_cast<void>(read_fixed_nodes("a.bou", content, 12)); },
      "11\n0 1 2 3 4 5 6 7 8 9 11\n");
}

TEST(DamagedFiles, PointCache) {
  PointCache cache;
  cache.positions = Eigen::MatrixXf::Constant(12, 7, 0.5f);
  torment([](const std::string& content) { static_cast<void>(read_pc2("a.pc2", content)); },
          write_pc2(cache));
}

TEST(DamagedFiles, VtuSeries) {
  const std::string good = read_bytes(testing::fixture("vtu_binary.vtu"));
  torment(
      [&](const std::string& content) {
        const auto frame = [&](std::size_t i) {
          return VtuFrame{"a.vtu", i == 0 ? good : content};
        };
        static_cast<void>(read_vtu_series("a.vtu", 2, frame, 12));
      },
      good);
}

TEST(DamagedFiles, Pvd) {
  torment([](const std::string& content) { static_cast<void>(pvd_files("a.pvd", content)); },
          write_pvd({"a.vtu", "b.vtu"}, {0, 0.5}));
}

const std::string kTetrahedronObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1//1 2//1 4//2\nf 2/1 3/2 4/3\nf -4 -1 -2\n";

TEST(DamagedFiles, Obj) {
  torment([](const std::string& content) { static_cast<void>(read_surface("a.obj", content)); },
          kTetrahedronObj);
}

TEST(DamagedFiles, Stl) {
  torment([](const std::string& content) { static_cast<void>(read_surface("a.stl", content)); },
          "solid a\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 "
          "0\nendloop\nendfacet\n"
          "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 "
          "1\nendloop\nendfacet\nendsolid a\n");
}

TEST(DamagedFiles, Off) {
  torment([](const std::string& content) { static_cast<void>(read_surface("a.off", content)); },
          "COFF # colours\n4 4 6\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n"
          "0 0 1 255 0 0 255\n3 0 2 1\n3 0 1 3 0.5 0.5 0.5\n3 1 2 3\n3 2 0 3\n");
}

TEST(DamagedFiles, Glb) {
  torment([](const std::string& content) { static_cast<void>(read_surface("a.glb", content)); },
          testing::tetrahedron_glb());
}

TEST(DamagedFiles, Ply) {
  torment([](const std::string& content) { static_cast<void>(read_surface("a.ply", content)); },
          "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float "
          "y\nproperty double z\n"
          "property uchar red\nelement face 1\nproperty list uchar int "
          "vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n"
          "3 0 1 2\n");
}

}  // namespace
}  // namespace limber::scene
