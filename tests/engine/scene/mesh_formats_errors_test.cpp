// Faults of a mesh file are reported with its name and line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

struct BadFile {
  const char* label;
  const char* name;
  std::string content;
  const char* message;  // part of it
  ErrorCode code = ErrorCode::kInvalidArgument;
};
std::ostream& operator<<(std::ostream& out, const BadFile& bad) { return out << bad.label; }

class BadMeshes : public ::testing::TestWithParam<BadFile> {};

TEST_P(BadMeshes, AreRefusedWithFileAndLine) {
  try {
    static_cast<void>(read_mesh({GetParam().name, GetParam().content, {}}));
    FAIL() << "was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), GetParam().code) << error.what();
    EXPECT_EQ(error.field(), GetParam().name);
    EXPECT_THAT(error.what(), HasSubstr(GetParam().message));
  }
}

const std::string kNodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n";
const std::string kGmsh = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
const std::string kGmsh2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
const std::string kVtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
const std::string kVtu =
    "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" "
    "NumberOfCells=\"1\">";

INSTANTIATE_TEST_SUITE_P(
    Cases, BadMeshes,
    ::testing::Values(
        BadFile{"Empty", "a.msh", "  \n", "the file is empty"},
        BadFile{"UnknownFormat", "a.xyz", "hello", "not recognised", ErrorCode::kUnsupported},
        BadFile{"NoTets", "a.inp", kNodes + "*ELEMENT, TYPE=S3\n1,1,2,3\n",
                "no tetrahedra (but 1 s3)"},
        BadFile{"NoNodes", "a.inp", "*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n", "no nodes"},
        BadFile{"UnknownNode", "a.inp", kNodes + "*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n2,1,2,3,9\n",
                "a.inp:8: tetrahedron 1 (from 0) uses node id 9"},
        BadFile{"NodeTwice", "a.inp", kNodes + "3,1,1,1\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n",
                "node id 3 is given twice"},
        BadFile{"NotANumber", "a.inp", "*NODE\n1,0,zero,0\n",
                "a.inp:2: expected coordinate y, found 'zero'"},
        BadFile{"NaN", "a.inp", "*NODE\n1,0,nan,0\n",
                "a.inp:2: expected coordinate y, found a value that is not finite"},
        BadFile{"Infinite", "a.inp", "*NODE\n1,0,1e999,0\n", "a.inp:2: expected coordinate y"},
        BadFile{"ShortLine", "a.inp", "*NODE\n1,0,0\n2,0,0,0\n",
                "a.inp:2: expected coordinate z, found the end of the line"},
        BadFile{"JoinedNumber", "a.inp", "*NODE\n1x,0,0,0\n",
                "a.inp:2: expected a node id, found '1x'"},
        BadFile{"AbaqusInclude", "a.inp", "*INCLUDE, INPUT=b.inp\n", "a.inp:1: *INCLUDE",
                ErrorCode::kUnsupported},
        BadFile{"HugeCount", "a.msh", kGmsh2 + "$Nodes\n1000000000000\n",
                "more than the rest of the file holds"},
        BadFile{"NegativeCount", "a.msh", kGmsh2 + "$Nodes\n-5\n", "is negative"},
        BadFile{"HugeBlocks", "a.msh", kGmsh + "$Nodes\n1 900000000 1 900000000\n3 0 0 900000000\n",
                "more than the rest of the file holds"},
        BadFile{"WrongTotal", "a.msh", kGmsh + "$Nodes\n1 2 1 1\n3 0 0 1\n1\n0 0 0\n$EndNodes\n",
                "hold 1 nodes, not 2"},
        BadFile{"UnknownElement", "a.msh",
                kGmsh2 + "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 99 0 1\n$EndElements\n",
                "element type 99", ErrorCode::kUnsupported},
        BadFile{"GmshVersion", "a.msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", "MSH version 4.0",
                ErrorCode::kUnsupported},
        BadFile{"GmshNoHeader", "a.msh", "1 2 3\n", "begins with '$MeshFormat'"},
        BadFile{"GmshUnended", "a.msh", kGmsh2 + "$Nodes\n1\n1 0 0 0\n$Elements\n",
                "expected '$EndNodes'"},
        BadFile{"MeditTruncated", "a.mesh",
                "MeshVersionFormatted 1\nDimension 3\nVertices\n2\n0.25 0.25 0.25 1\n",
                "a.mesh:6: expected coordinate x, found the end of the file"},
        BadFile{"MeditFlat", "a.mesh", "MeshVersionFormatted 1\nDimension 2\n",
                "the dimension is 2"},
        BadFile{"TetgenAlone", "a.node", "1 3 0 0\n0 0 0 0\n", "the .ele file is missing",
                ErrorCode::kNotFound},
        BadFile{"VtkPolyData", "a.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n",
                "UNSTRUCTURED_GRID is read", ErrorCode::kUnsupported},
        BadFile{"VtkCellTooLong", "a.vtk",
                kVtk + "POINTS 1 float\n0 0 0\nCELLS 1 5\n40 0 0 0 0\nCELL_TYPES 1\n10\n",
                "cell 0 (from 0) has 40 points"},
        BadFile{"VtkPointRange", "a.vtk",
                kVtk + "POINTS 1 float\n0 0 0\nCELLS 1 5\n4 0 0 0 7\nCELL_TYPES 1\n10\n",
                "cell 0 (from 0) uses point 7 of 1"},
        BadFile{"VtkTypes", "a.vtk",
                kVtk + "POINTS 1 float\n0 0 0\nCELLS 1 5\n4 0 0 0 0\nCELL_TYPES 2\n10\n10\n",
                "1 cells but 2 cell types"},
        BadFile{"VtuNotXml", "a.vtu", "<VTKFile type=\"UnstructuredGrid\">\n<Piece\n",
                "not valid XML"},
        BadFile{"VtuKind", "a.vtu", "<VTKFile type=\"ImageData\"/>",
                "a VTK file of type 'ImageData'", ErrorCode::kUnsupported},
        BadFile{
            "VtuPoints", "a.vtu",
            kVtu + "<Points><DataArray type=\"Float32\" format=\"ascii\">1 2 3</DataArray></Points>"
                   "</Piece></UnstructuredGrid></VTKFile>",
            "the points are 3 numbers"},
        BadFile{
            "VtuBase64", "a.vtu",
            kVtu + "<Points><DataArray type=\"Float32\" format=\"binary\">!!!!</DataArray></Points>"
                   "</Piece></UnstructuredGrid></VTKFile>",
            "is not valid base64"},
        BadFile{"VtuHuge", "a.vtu",
                kVtu + "<Points><DataArray type=\"Float32\" "
                       "format=\"binary\">/////w==</DataArray></Points>"
                       "</Piece></UnstructuredGrid></VTKFile>",
                "claims 4294967295 bytes", ErrorCode::kLimitExceeded},
        BadFile{
            "VtuOffset", "a.vtu",
            kVtu +
                "<Points><DataArray type=\"Float32\" format=\"appended\" offset=\"99\"/></Points>"
                "</Piece></UnstructuredGrid><AppendedData "
                "encoding=\"raw\">_abc</AppendedData></VTKFile>",
            "begins outside of the appended data"},
        BadFile{"VegaNoSection", "a.veg", "1 2 3\n", "expected a section"},
        BadFile{"VegaUnknownSet", "a.veg",
                "*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n"
                "1 1 2 3 4\n*MATERIAL m\nENU, 1, 1, 0\n*REGION\nnone, m\n",
                "a.veg:14: the set 'none' is not defined"},
        BadFile{"Gmsh1Nodes", "a.msh",
                "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 4 1 1 3 1 1 1\n$ENDELM\n",
                "a.msh:7: a tetrahedron with 3 nodes"}),
    [](const auto& test) { return test.param.label; });

TEST(MeshFormats, UnsupportedCompressionIsNamed) {
  try {
    static_cast<void>(read_mesh_file(testing::fixture("vtu_lzma.vtu")));
    FAIL() << "was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr("vtkLZMADataCompressor"));
  }
}

TEST(MeshFormats, MissingFilesFoldersAndLargeFilesAreNamed) {
  const auto code_of = [](const std::filesystem::path& path, std::size_t max_bytes) {
    try {
      static_cast<void>(read_mesh_file(path, max_bytes));
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(code_of("/does/not/exist.msh", 1000), ErrorCode::kIo);
  EXPECT_EQ(code_of(testing::fixture(""), 1000), ErrorCode::kIo);
  EXPECT_EQ(code_of(testing::fixture("medit.mesh"), 10), ErrorCode::kLimitExceeded);
}

/// 50^7 inclusions without any cycle, and one cycle.
TEST(MeshFormats, IncludesThatMultiplyOrNeverEndAreRefused) {
  const auto includes = [](const std::string& name) {
    std::string text;
    for (int i = 0; i < 50; ++i) text += "*INCLUDE " + name + "\n";
    return text;
  };
  MeshFileSet files{"a.veg", includes("0"), {}};
  for (int level = 0; level < 6; ++level)
    files.companions[std::to_string(level)] = includes(std::to_string(level + 1));
  files.companions["6"] = "# nothing";
  const MeshFileSet cycle{"a.veg", includes("self"), {{"self", includes("self")}}};
  for (const MeshFileSet& set : {files, cycle}) {
    try {
      static_cast<void>(read_mesh(set));
      FAIL() << "was read";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("nested too deeply or used too often"));
    }
  }
}

/// A reply has what a reader says of a file: its length must not be that of the file.
TEST(MeshFormatsErrors, WhatIsSaidOfAFileIsShort) {
  const std::string nodes = "*NODE\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n";
  const std::string tet = "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n";
  std::string others;
  for (int i = 0; i < 5000; ++i)
    others += "*ELEMENT, TYPE=KIND" + std::to_string(i) + "\n" + std::to_string(i + 2) + ", 1,2\n";
  others += "*ELEMENT, TYPE=" + std::string(100'000, 'x') + "\n9999, 1,2\n";
  try {
    (void)read_mesh({"a.inp", nodes + others, {}});
    ADD_FAILURE() << "there are no tets";
  } catch (const Error& error) {
    EXPECT_LT(std::string(error.what()).size(), 2000U);
  }
  const MeshReading reading = read_mesh({"a.inp", nodes + tet + others, {}});
  EXPECT_LT(reading.warnings.size(), 30U);
  for (const auto& warning : reading.warnings) EXPECT_LT(warning.size(), 200U);

  std::string includes;
  for (int i = 0; i < 5000; ++i) includes += "*INCLUDE part" + std::to_string(i) + ".veg\n";
  const MeshReading parts = read_mesh({"a.veg",
                                       "*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 "
                                       "1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n" +
                                           includes,
                                       {}});
  EXPECT_LT(parts.warnings.size(), 60U);
}

/// Else 600 kB of files take gigabytes of memory.
TEST(MeshFormatsErrors, VegaIncludesBringNoMoreThanTheirFiles) {
  const std::string mesh =
      "*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n";
  std::string ids;
  for (int i = 0; i < 100'000; ++i) ids += "1, ";
  std::string sets;
  for (int i = 0; i < 20; ++i) sets += "*SET s" + std::to_string(i) + "\n*INCLUDE ids.veg\n";
  try {
    (void)read_mesh({"a.veg", mesh + sets, {{"ids.veg", ids}}});
    ADD_FAILURE() << "was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
    EXPECT_THAT(error.what(), HasSubstr("include each file once"));
  }
  // As often as it likes, where it is small.
  EXPECT_EQ(read_mesh({"a.veg", mesh + sets, {{"ids.veg", "1\n"}}}).mesh.tet_count(), 1);
  EXPECT_EQ(read_mesh({"a.veg", mesh + "*SET s\n*INCLUDE ids.veg\n", {{"ids.veg", ids}}})
                .mesh.tet_count(),
            1);
}

}  // namespace
}  // namespace limber::scene
