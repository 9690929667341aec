// Materials and groups of tets in mesh files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/mesh_writers.h"

namespace limber::scene {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr const char* kSixNodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,1,1\n6,2,1,1\n";

MeshReading read_inp(const std::string& rest) { return read_mesh({"a.inp", kSixNodes + rest, {}}); }

constexpr const char* kTwoSets =
    "*ELEMENT, TYPE=C3D4, ELSET=Soft\n1,1,2,3,4\n*ELEMENT, TYPE=C3D4, ELSET=Hard\n2,2,3,4,5\n"
    "3,2,3,5,6\n";

TEST(AbaqusMaterials, SectionsGiveTheirSetsAMaterial) {
  const MeshReading reading =
      read_inp(std::string(kTwoSets) +
               "*MATERIAL, NAME=rubber\n*DENSITY\n500.,\n*ELASTIC\n1000., .4\n"
               "*MATERIAL, NAME=\"Stiff one\"\n*Elastic, type=ISOTROPIC\n1e7, 0.3\n*Density\n900.\n"
               "*SOLID SECTION, ELSET=soft, MATERIAL=RUBBER\n,\n"
               "*Solid Section, elset=HARD, material=\"stiff one\"\n");
  ASSERT_EQ(reading.mesh.materials.size(), 2U);
  EXPECT_EQ(reading.mesh.material_of(0), (bodies::Material{1000, 0.4, 500}));
  EXPECT_EQ(reading.mesh.material_of(1), (bodies::Material{1e7, 0.3, 900}));
  EXPECT_EQ(reading.mesh.material_of(2), reading.mesh.material_of(1));
  ASSERT_EQ(reading.groups.size(), 2U);
  EXPECT_EQ(reading.groups[1].name, "hard");
  EXPECT_THAT(reading.groups[1].tets, ElementsAre(1, 2));
  EXPECT_THAT(reading.warnings, Contains(HasSubstr("2 tetrahedra of the set 'hard' have the "
                                                   "material 'stiff one' of the file")));
}

TEST(AbaqusMaterials, SetsMayBeListedGeneratedAndNested) {
  const MeshReading reading = read_inp(
      "*ELEMENT, TYPE=C3D4\n10,1,2,3,4\n20,2,3,4,5\n30,2,3,5,6\n"
      "*ELSET, ELSET=ends\n10, 30\n*ELSET, ELSET=run, GENERATE\n20, 1000000000, 10\n"
      "*ELSET, ELSET=all_of_it\nends, run\n"
      "*MATERIAL, NAME=m\n*ELASTIC\n5, 0.25\n*SOLID SECTION, ELSET=all_of_it, MATERIAL=m\n");
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(0, 0, 0));
  ASSERT_EQ(reading.groups.size(), 2U) << "a set of all tets is no group";
  EXPECT_THAT(reading.groups[0].tets, ElementsAre(0, 2));
  EXPECT_THAT(reading.groups[1].tets, ElementsAre(1, 2));
  EXPECT_THAT(reading.warnings, Contains(HasSubstr("'m' has no *DENSITY: 1000 kg/m^3")));
}

TEST(AbaqusMaterials, WhatIsNotTakenIsListed) {
  const auto warnings = [](const std::string& rest) {
    return read_inp(std::string(kTwoSets) + rest).warnings;
  };
  EXPECT_THAT(warnings("*MATERIAL, NAME=m\n*ELASTIC\n5, 0.25\n"),
              Contains(HasSubstr("1 materials and no *SOLID SECTION")));
  EXPECT_THAT(warnings("*SOLID SECTION, ELSET=soft, MATERIAL=gone\n"),
              Contains(HasSubstr("the file has no material 'gone'")));
  const std::string section = "*SOLID SECTION, ELSET=soft, MATERIAL=m\n";
  EXPECT_THAT(warnings("*MATERIAL, NAME=m\n*ELASTIC, TYPE=ORTHOTROPIC\n1,2,3\n" + section),
              Contains(HasSubstr("elastic, type=orthotropic is not read")));
  EXPECT_THAT(warnings("*MATERIAL, NAME=m\n*HYPERELASTIC, NEO HOOKE\n1,2\n" + section),
              Contains(HasSubstr("has no isotropic *ELASTIC")));
  EXPECT_THAT(warnings("*MATERIAL, NAME=m\n*ELASTIC\n5, 0.25, 20\n6, 0.25, 90\n" + section),
              Contains(HasSubstr("depends on temperature")));
  EXPECT_THAT(warnings("*MATERIAL, NAME=m\n*ELASTIC\n5, 0.5\n" + section),
              Contains(HasSubstr("a material in the file that is none")));
  const std::string material = "*MATERIAL, NAME=m\n*ELASTIC\n5, 0.25\n";
  EXPECT_THAT(warnings(material + "*SOLID SECTION, ELSET=gone, MATERIAL=m\n"),
              Contains(HasSubstr("of the set 'gone': the file has no such set")));
  EXPECT_THAT(warnings(material + "*ELSET, ELSET=shells\n70, 71\n" +
                       "*SOLID SECTION, ELSET=shells, MATERIAL=m\n"),
              Contains(HasSubstr("of the set 'shells': no tetrahedra are found in it")));
  EXPECT_THAT(warnings("*ELSET, ELSET=far, INSTANCE=one\n1, 2\n"),
              Contains(HasSubstr("*elset of an instance is not read")));
  EXPECT_THAT(
      read_inp("*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n*SOLID SECTION, ELSET=gone, MATERIAL=m\n").warnings,
      Contains(HasSubstr("the file has no such set")))
      << "of a file with sections alone";
}

TEST(AbaqusMaterials, SetsThatNameEachOtherEnd) {
  std::string chain = "*MATERIAL, NAME=m\n*ELASTIC\n5, 0.25\n*ELSET, ELSET=s0\ns1\n";
  for (int i = 1; i < 20000; ++i)
    chain += "*ELSET, ELSET=s" + std::to_string(i) + "\ns" + std::to_string(i + 1) + "\n";
  chain += "*ELSET, ELSET=s20000\ns0, 2\n*SOLID SECTION, ELSET=s0, MATERIAL=m\n";
  const MeshReading reading = read_inp(std::string(kTwoSets) + chain);
  ASSERT_EQ(reading.mesh.materials.size(), 2U) << "and the default one";
  EXPECT_THAT(reading.mesh.tet_material, ElementsAre(1, 0, 1));
}

constexpr const char* kGroupedGmsh =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    "$PhysicalNames\n3\n2 7 \"skin\"\n3 7 \"soft\"\n3 9 \"hard\"\n$EndPhysicalNames\n"
    "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n"
    "$Elements\n3\n1 2 2 7 1 1 2 3\n2 4 2 7 1 1 2 3 4\n3 4 2 9 1 2 3 4 5\n$EndElements\n";

TEST(GmshGroups, PhysicalVolumesAreGroups) {
  const MeshReading reading = read_mesh({"a.msh", kGroupedGmsh, {}});
  ASSERT_EQ(reading.groups.size(), 2U);
  EXPECT_EQ(reading.groups[0].name, "soft");
  EXPECT_THAT(reading.groups[0].tets, ElementsAre(0));
  EXPECT_EQ(reading.groups[1].name, "hard");
  EXPECT_THAT(reading.groups[1].tets, ElementsAre(1));
  EXPECT_TRUE(reading.mesh.materials.empty());
}

TEST(GmshGroups, Version4NamesThemByEntities) {
  const MeshReading reading = read_mesh(
      {"a.msh",
       "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
       "$PhysicalNames\n1\n3 9 \"hard\"\n$EndPhysicalNames\n"
       "$Entities\n1 0 0 2\n5 0 0 0 0\n1 0 0 0 1 1 1 0 0\n2 0 0 0 1 1 1 1 9 1 -3\n$EndEntities\n"
       "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
       "$Elements\n2 2 1 2\n3 1 4 1\n1 1 2 3 4\n3 2 4 1\n2 2 3 4 5\n$EndElements\n",
       {}});
  ASSERT_EQ(reading.groups.size(), 1U);
  EXPECT_EQ(reading.groups[0].name, "hard");
  EXPECT_THAT(reading.groups[0].tets, ElementsAre(1));
}

TEST(GmshGroups, OneWithoutANameIsNone) {
  std::string text = kGroupedGmsh;
  text.erase(text.find("$PhysicalNames"), text.find("$Nodes") - text.find("$PhysicalNames"));
  text.replace(text.find("4 2 9"), 5, "4 2 7");
  EXPECT_THAT(read_mesh({"a.msh", text, {}}).groups, IsEmpty());
}

TEST(MeditGroups, ReferencesAreGroups) {
  const MeshReading reading = read_mesh(
      {"a.mesh",
       "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
       "1 1 1 0\nTetrahedra 2\n1 2 3 4 1\n2 3 4 5 2\nEnd\n",
       {}});
  ASSERT_EQ(reading.groups.size(), 2U);
  EXPECT_EQ(reading.groups[1].name, "2");
  EXPECT_THAT(reading.groups[1].tets, ElementsAre(1));
}

TEST(TetgenGroups, RegionsAreGroups) {
  const MeshReading reading = read_mesh({"a.node",
                                         "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n",
                                         {{"a.ele", "2 4 1\n1 1 2 3 4 10\n2 2 3 4 5 -4\n"}}});
  ASSERT_EQ(reading.groups.size(), 2U);
  EXPECT_EQ(reading.groups[0].name, "-4");
  EXPECT_THAT(reading.groups[0].tets, ElementsAre(1));
}

constexpr const char* kTwoTetsVtk =
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
    "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 3 14\n3 0 1 2\n4 0 1 2 3\n4 1 2 3 4\n"
    "CELL_TYPES 3\n5\n10\n10\n";

TEST(VtkMaterials, CellDataAreTaken) {
  const MeshReading reading = read_mesh(
      {"a.vtk",
       std::string(kTwoTetsVtk) +
           "POINT_DATA 5\nSCALARS height float\nLOOKUP_TABLE default\n0 0 0 1 1\n"
           "CELL_DATA 3\nVECTORS fibre float\n1 0 0 1 0 0 1 0 0\n"
           "SCALARS Youngs_Modulus double 1\nLOOKUP_TABLE default\n0 1000 2000\n"
           "FIELD FieldData 2\npoissons_ratio 1 3 double\n0 0.3 0.4\nmaterial 1 3 int\n0 4 5\n",
       {}});
  ASSERT_EQ(reading.mesh.materials.size(), 2U);
  EXPECT_EQ(reading.mesh.material_of(0), (bodies::Material{1000, 0.3, 1000}));
  EXPECT_EQ(reading.mesh.material_of(1), (bodies::Material{2000, 0.4, 1000}));
  ASSERT_EQ(reading.groups.size(), 2U);
  EXPECT_EQ(reading.groups[0].name, "4");
  EXPECT_THAT(reading.warnings, Contains(HasSubstr("1 cell arrays are not read (fibre)")));
  EXPECT_THAT(reading.warnings, Contains(HasSubstr("no density: 1000 kg/m^3")));
}

TEST(VtkMaterials, BinaryLabelsWithoutASignHaveNone) {
  const auto big_endian = [](std::uint64_t value, std::size_t size) {
    std::string bytes;
    for (std::size_t i = size; i-- > 0;) bytes += static_cast<char>(value >> (8 * i) & 0xff);
    return bytes;
  };
  std::string mesh =
      "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n";
  constexpr float kPoints[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  for (const float value : kPoints) mesh += big_endian(std::bit_cast<std::uint32_t>(value), 4);
  mesh += "\nCELLS 2 10\n";
  for (const int value : {4, 0, 1, 2, 3, 4, 1, 2, 3, 4})
    mesh += big_endian(static_cast<std::uint64_t>(value), 4);
  mesh += "\nCELL_TYPES 2\n" + big_endian(10, 4) + big_endian(10, 4);
  const auto names = [&](const std::string& type, std::size_t size) {
    // The largest label, and 5.
    const std::uint64_t largest = ~std::uint64_t{0} >> (64 - 8 * size);
    const MeshReading reading =
        read_mesh({"a.vtk",
                   mesh + "\nCELL_DATA 2\nSCALARS material " + type + "\nLOOKUP_TABLE default\n" +
                       big_endian(largest, size) + big_endian(5, size),
                   {}});
    std::vector<std::string> result;
    for (const auto& group : reading.groups) result.push_back(group.name);
    return result;
  };
  EXPECT_THAT(names("unsigned_char", 1), UnorderedElementsAre("255", "5"));
  EXPECT_THAT(names("unsigned_short", 2), UnorderedElementsAre("65535", "5"));
  EXPECT_THAT(names("Unsigned_Int", 4), UnorderedElementsAre("4294967295", "5"));
  EXPECT_THAT(names("char", 1), UnorderedElementsAre("-1", "5"));
}

TEST(VtkMaterials, PartsOfAMaterialAndBrokenDataAreReported) {
  const MeshReading part =
      read_mesh({"a.vtk",
                 std::string(kTwoTetsVtk) +
                     "CELL_DATA 3\nSCALARS density double\nLOOKUP_TABLE default\n1 2 3\n",
                 {}});
  EXPECT_TRUE(part.mesh.materials.empty());
  EXPECT_THAT(part.warnings, Contains(HasSubstr("a part of a material alone")));
  const MeshReading broken = read_mesh(
      {"a.vtk",
       std::string(kTwoTetsVtk) + "CELL_DATA 3\nSCALARS density double\nLOOKUP_TABLE d\n1 x",
       {}});
  EXPECT_EQ(broken.mesh.tet_count(), 2);
  EXPECT_THAT(broken.warnings, Contains(HasSubstr("the cell data are read as far as possible")));
}

TEST(VtuMaterials, WhatIsWrittenIsReadAgain) {
  bodies::TetMesh mesh = read_mesh({"a.msh", kGroupedGmsh, {}}).mesh;
  mesh.materials = {{1000, 0.3, 500}, {2e7, 0.45, 900}};
  mesh.tet_material = {1, 0};
  const MeshReading reading = read_mesh({"a.vtu", write_vtu(mesh), {}});
  ASSERT_EQ(reading.mesh.materials.size(), 2U);
  for (int tet = 0; tet < 2; ++tet)
    EXPECT_EQ(reading.mesh.material_of(tet), mesh.material_of(tet)) << tet;
  EXPECT_THAT(reading.warnings, IsEmpty());
}

}  // namespace
}  // namespace limber::scene
