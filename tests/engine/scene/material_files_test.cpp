#include "engine/scene/formats/material_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

MeshReading five_tets() {
  MeshReading reading;
  reading.mesh.nodes = bodies::NodePositions::Random(3, 8);
  reading.mesh.tets = bodies::TetNodes::Zero(4, 5);
  return reading;
}

const std::string kHeader =
    "*groups 2\n\n*MATERIAL, NAME=A\n*ELASTIC\n7e+06, 0.45\n*DENSITY 100\n*num_of_tets "
    "2\n\n*MATERIAL, NAME=B\n*ELASTIC\n"
    "5e+04, 0.3\n*DENSITY 200\n*num_of_tets 3\n\n";

std::string material_refusal(const std::string& text) {
  MeshReading reading = five_tets();
  try {
    read_materials("m.elastic", text, reading);
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "m.elastic");
    return error.what();
  }
  return "";
}

TEST(Materials, IdsFromZeroAreRecognisedByTheirZero) {
  MeshReading reading = five_tets();
  read_materials("m", kHeader + "*ELSET, ELSET=A\n1, 4, \n*ELSET, ELSET=B\n0, 2, 3\n", reading);
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(1, 0, 1, 1, 0));
  EXPECT_EQ(reading.mesh.materials[0], (bodies::Material{7e6, 0.45, 100}));
  EXPECT_EQ(reading.mesh.materials[1], (bodies::Material{5e4, 0.3, 200}));
  EXPECT_TRUE(reading.warnings.empty());
}

TEST(Materials, IdsFromOneAreRecognisedByTheLast) {
  MeshReading reading = five_tets();
  read_materials("m", kHeader + "*ELSET, ELSET=A\n2, 5\n*ELSET, ELSET=B\n1, 3, 4\n", reading);
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(1, 0, 1, 1, 0));
}

TEST(Materials, AGroupWithoutListIsForTheRest) {
  MeshReading reading = five_tets();
  read_materials("m", "*MATERIAL, NAME=A\n*ELASTIC\n1.0, 0.45\n*DENSITY 1", reading);
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(0, 0, 0, 0, 0));
}

TEST(Materials, TetsLeftOverGetTheDefaultAndAWarning) {
  MeshReading reading = five_tets();
  read_materials("m", "*MATERIAL, NAME=A\n*ELASTIC\n1.0, 0.45\n*DENSITY 1\n*ELSET, ELSET=A\n0, 1\n",
                 reading);
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(0, 0, 1, 1, 1));
  EXPECT_EQ(reading.mesh.materials[1], bodies::Material{});
  ASSERT_EQ(reading.warnings.size(), 1);
  EXPECT_THAT(reading.warnings[0], HasSubstr("3 tetrahedra have no material"));
}

TEST(Materials, ContradictionsAreRefused) {
  EXPECT_THAT(material_refusal(kHeader + "*ELSET, ELSET=A\n0, 5\n*ELSET, ELSET=B\n1, 3, 4\n"),
              HasSubstr("run from 0 to 5"));
  EXPECT_THAT(material_refusal(kHeader + "*ELSET, ELSET=A\n0, 1\n*ELSET, ELSET=B\n1, 3, 4\n"),
              HasSubstr("has a material already"));
  EXPECT_THAT(material_refusal(kHeader + "*ELSET, ELSET=A\n0\n*ELSET, ELSET=B\n1, 3, 4\n"),
              HasSubstr("announces 2 tets, its list has 1"));
  EXPECT_THAT(material_refusal(kHeader + "*ELSET, ELSET=C\n0\n"),
              HasSubstr("no material for the set 'C'"));
  EXPECT_THAT(material_refusal(kHeader + "*ELSET, ELSET=A\n0, 6\n*ELSET, ELSET=B\n1, 3, 4\n"),
              HasSubstr("tet id 6 of a mesh of 5"));
  EXPECT_THAT(material_refusal("0, 1"),
              HasSubstr("m.elastic:1: expected a line that begins with '*'"));
  EXPECT_THAT(material_refusal(""), HasSubstr("no materials"));
}

TEST(FixedNodes, AreSortedUniqueAndChecked) {
  EXPECT_THAT(read_fixed_nodes("a", "4\n5 1 1 0\n", 6), ElementsAre(0, 1, 5));
  EXPECT_THROW(static_cast<void>(read_fixed_nodes("a", "2\n5 6\n", 6)), Error);
  EXPECT_THROW(static_cast<void>(read_fixed_nodes("a", "3\n5 4\n", 6)), Error);
  EXPECT_THROW(static_cast<void>(read_fixed_nodes("a", "1\n5 4\n", 6)), Error);
  EXPECT_THROW(static_cast<void>(read_fixed_nodes("a", "4000000000\n5\n", 6)), Error);
}

/// The paper's bodies: every tet in exactly one group, ids from 0 for any index.
TEST(Materials, OfThePapersBodiesAreRead) {
  const struct {
    const char* folder;
    const char* file;
    std::size_t groups;
    int fixed;
  } cases[] = {{"beam", "mesh.elastic", 2, 162},
               {"beam", "mtl_two.elastic", 3, 162},
               {"beam", "mtl_smooth.elastic", 5378, 162},
               {"dino", "mesh.elastic", 1463, 76},
               {"tyrannosaurus", "mesh.elastic", 1, 55}};
  for (const auto& c : cases) {
    const std::filesystem::path folder = testing::shared_body(c.folder);
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
    SCOPED_TRACE(std::string(c.folder) + "/" + c.file);
    MeshReading reading = read_mesh({"mesh.abq", read_bytes(folder / "mesh.abq"), {}});
    read_materials(c.file, read_bytes(folder / c.file), reading);
    EXPECT_EQ(reading.mesh.materials.size(), c.groups);
    EXPECT_EQ(static_cast<int>(reading.mesh.tet_material.size()), reading.mesh.tet_count());
    // mtl_two lists only some of 6144 tets: the others get the default and a warning.
    EXPECT_EQ(reading.warnings.size(), std::string(c.file) == "mtl_two.elastic" ? 1 : 0);
    for (const bodies::Material& material : reading.mesh.materials)
      EXPECT_EQ(material.poissons_ratio, 0.45);
    EXPECT_EQ(
        read_fixed_nodes("bou", read_bytes(folder / "con_nodes.bou"), reading.mesh.node_count())
            .size(),
        c.fixed);
  }
  // The fixed end of the beam is stiff in mtl_two, which settles where its ids count from.
  MeshReading beam = read_mesh({"mesh.abq", read_bytes(testing::shared_body("beam/mesh.abq")), {}});
  read_materials("mtl_two", read_bytes(testing::shared_body("beam/mtl_two.elastic")), beam);
  double stiff_end = -1, soft_begin = 1;
  for (int t = 0; t < beam.mesh.tet_count(); ++t) {
    double x = 0;
    for (int c = 0; c < 4; ++c) x += 0.25 * beam.mesh.nodes(0, beam.mesh.tets(c, t));
    const bool stiff = beam.mesh
                           .materials[static_cast<std::size_t>(
                               beam.mesh.tet_material[static_cast<std::size_t>(t)])]
                           .youngs_modulus > 1e6;
    if (stiff) {
      stiff_end = std::max(stiff_end, x);
    } else {
      soft_begin = std::min(soft_begin, x);
    }
  }
  EXPECT_LT(stiff_end, soft_begin);
}

TEST(Materials, OfTheSameStemAreTakenFromDiskAndAnnounced) {
  const std::filesystem::path path = testing::shared_body("beam/mesh.abq");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const MeshReading reading = read_mesh_file(path);
  EXPECT_EQ(reading.mesh.materials.size(), 2);
  ASSERT_FALSE(reading.warnings.empty());
  EXPECT_THAT(reading.warnings.back(), HasSubstr("materials are taken from mesh.elastic"));
}

}  // namespace
}  // namespace limber::scene
