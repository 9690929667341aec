#include <gtest/gtest.h>

#include <functional>
#include <initializer_list>

#include "engine/base/error.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/edge_formats.h"
#include "engine/scene/formats/line_formats.h"
#include "engine/scene/formats/surface_formats.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

constexpr const char* kPly =
    "ply\nformat ascii 1.0\ncomment a frame\n"
    "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
    "property double nx\nproperty double ny\nproperty double nz\nproperty uchar red\n"
    "element face 1\nproperty list uchar int vertex_indices\n"
    "element edge 2\nproperty int vertex1\nproperty int vertex2\n"
    "property list char double beam_dimensions\nend_header\n"
    "0 0 0 0 0 1 255\n1 0 0 0 1 0 255\n1 2 0 1 0 0 255\n3 0 1 2\n0 1 2 0.1 0.2\n2 1 0\n";

std::string field_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.field();
  }
  return "accepted";
}

TEST(EdgeFiles, PlyWithNormalsFacesAndListsOnEdges) {
  const EdgeMesh mesh = read_edge_mesh("frame.ply", kPly);
  ASSERT_EQ(mesh.edges.size(), 2);
  EXPECT_EQ(mesh.edges[0], (std::pair{0, 1}));
  EXPECT_EQ(mesh.edges[1], (std::pair{2, 1}));
  EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(1, 2, 0));
  EXPECT_EQ(mesh.normals.col(1), Eigen::Vector3d(0, 1, 0));
}

TEST(EdgeFiles, ObjLines) {
  const EdgeMesh mesh = read_edge_mesh("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\n");
  ASSERT_EQ(mesh.edges.size(), 2);
  EXPECT_EQ(mesh.edges[1], (std::pair{1, 2}));
  EXPECT_EQ(mesh.normals.col(0), Eigen::Vector3d(0, 0, 1));
}

TEST(EdgeFiles, ObjThatCountsFromZeroIsRefusedWithTheRule) {
  const std::string zero = "v 0 0 0\nv 1 0 0\nl 0 1\n";
  const std::string message = "a.obj:3: vertex index 0: OBJ files count vertices from 1";
  for (const auto& read : std::initializer_list<std::function<void()>>{
           [&] { (void)read_edge_mesh("a.obj", zero); },
           [&] { (void)read_line_mesh("a.obj", zero); },
           [&] { (void)read_surface("a.obj", "v 0 0 0\nv 1 0 0\nf 0/1 1/1 0/2\n"); }}) {
    try {
      read();
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with(message)) << error.what();
    }
  }
}

TEST(EdgeFiles, BadFilesAreRefused) {
  std::string text = kPly;
  text.replace(text.find("2 1 0\n"), 5, "2 3 0");
  EXPECT_EQ(field_of([&] { (void)read_edge_mesh("frame.ply", text); }), "frame.ply");
  EXPECT_EQ(field_of([&] {
              (void)read_edge_mesh("frame.ply", std::string(kPly).substr(0, text.size() - 3));
            }),
            "frame.ply");
  EXPECT_EQ(field_of([] {
              (void)read_edge_mesh("p.ply",
                                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float "
                                   "x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
            }),
            "p.ply");
  EXPECT_EQ(field_of([] { (void)read_edge_mesh("p.stl", ""); }), "p.stl");
}

constexpr const char* kJob =
    R"({"beam material":[0.3,1e9],"cross section dim":[0.02,0.03],"fixed vertices":[[0,[0,1,2]]],
"forces":[[2,[1,2,3,4,5,6]]],"forced displacements":[[1,[0.1,0,-0.2]]],"mesh filename":"frame.ply",
"meshLabel":"frame"})";

TEST(BeamJobs, AreReadAsTheyAre) {
  const BeamJob job =
      read_beam_job(kJob, R"({"gamma":1,"initialDistortion":{"duration":{"endStep":1,"startStep":0},
"load":[0,0,7,0,0,8]}})");
  EXPECT_EQ(job.section_width, 0.02);
  EXPECT_EQ(job.section_height, 0.03);
  EXPECT_EQ(job.poisson, 0.3);
  EXPECT_EQ(job.young, 1e9);
  EXPECT_EQ(job.mesh_file, "frame.ply");
  ASSERT_EQ(job.fixed.size(), 1);
  EXPECT_EQ(job.fixed[0].directions, (std::array{true, true, true, false, false, false}));
  ASSERT_EQ(job.forces.size(), 1);
  EXPECT_EQ(job.forces[0].vertex, 2);
  EXPECT_EQ(job.forces[0].moment, Eigen::Vector3d(4, 5, 6));
  ASSERT_EQ(job.displacements.size(), 1);
  EXPECT_EQ(job.displacements[0].displacement, Eigen::Vector3d(0.1, 0, -0.2));
  EXPECT_EQ(job.initial_force, Eigen::Vector3d(0, 0, 7));
  EXPECT_EQ(job.initial_moment, Eigen::Vector3d(0, 0, 8));
  EXPECT_TRUE(read_beam_job(kJob, R"({"initialDistortion":null})").initial_force.isZero(0));
}

std::string refusal_of(const std::string& job, const std::string& settings = {}) {
  try {
    (void)read_beam_job(job, settings);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BeamJobs, MisspeltKeysAreRefusedByNameWithTheNearestOne) {
  const auto misspelt = [](const std::string& from, const std::string& to) {
    std::string text = kJob;
    text.replace(text.find(from), from.size(), to);
    return refusal_of(text);
  };
  EXPECT_EQ(misspelt("\"forces\"", "\"force\""),
            "force is no key of SimulationJob.json: did you mean \"forces\"?");
  EXPECT_EQ(misspelt("fixed vertices", "fixedVertices"),
            "fixedVertices is no key of SimulationJob.json: did you mean \"fixed vertices\"?");
  EXPECT_EQ(misspelt("mesh filename", "mesh_filename"),
            "mesh_filename is no key of SimulationJob.json: did you mean \"mesh filename\"?");
  EXPECT_EQ(misspelt("beam material", "beam matreial"),
            "beam matreial is no key of SimulationJob.json: did you mean \"beam material\"?");
  EXPECT_NE(misspelt("meshLabel", "colour").find("which are \"label\", \"mesh filename\""),
            std::string::npos);
  EXPECT_EQ(refusal_of(kJob, R"({"initialDistorsion":{"load":[0,0,7,0,0,8]}})"),
            "initialDistorsion is no key of DRMSettings.json: did you mean \"initialDistortion\"?");
  EXPECT_EQ(refusal_of(kJob, R"({"initialDistortion":{"loads":[0,0,7,0,0,8]}})"),
            "loads is no key of initialDistortion: did you mean \"load\"?");
  EXPECT_EQ(refusal_of(kJob, R"({"isBreakOnDivergence":true,"Dtini":1})"), "accepted");
}

TEST(BeamJobs, IndicesBeyond32BitsAreRefused) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kJob;
    text.replace(text.find(from), from.size(), to);
    return refusal_of(text);
  };
  for (const char* index :
       {"4294967296", "4294967297", "2147483648", "9223372036854775807", "9223372036854775808",
        "18446744073709551615", "18446744073709551616", "-1", "-4294967296", "-9223372036854775808",
        "0.5", "1.0", "true", "\"0\"", "null", "[0]"}) {
    EXPECT_EQ(with("[[0,[0,1,2]]]", std::string("[[0,[") + index + "]]]"),
              "fixed vertices[0] has a direction that is not 0 to 5")
        << index;
    for (const auto& [member, entry] : {std::pair{"fixed vertices[0]", "[[0,[0,1,2]]]"},
                                        {"forces[0]", "[[2,[1,2,3,4,5,6]]]"},
                                        {"forced displacements[0]", "[[1,[0.1,0,-0.2]]]"}}) {
      std::string spoiled = entry;
      spoiled.replace(2, 1, index);
      EXPECT_EQ(with(entry, spoiled), std::string(member) + " is not [vertex, numbers]") << index;
    }
  }
}

TEST(EdgeFiles, VerticesThatAreNoWholeNumbersOfAnIntAreRefused) {
  for (const char* index : {"1.5", "4294967296", "-4294967296", "1e300", "2147483648"}) {
    std::string text = kPly;
    text.replace(text.find("property int vertex1"), 20, "property double vertex1");
    text.replace(text.find("2 1 0\n"), 1, index);
    EXPECT_EQ(field_of([&] { (void)read_edge_mesh("frame.ply", text); }), "frame.ply") << index;
  }
}

TEST(BeamJobs, AByteOrderMarkIsSkipped) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(read_beam_job(mark + kJob, mark + "{}").forces.size(), 1U);
  EXPECT_EQ(read_edge_mesh("frame.ply", mark + kPly).edges.size(), 2U);
  EXPECT_EQ(read_edge_mesh("a.obj", mark + "v 0 0 0\nv 1 0 0\nl 1 2\n").vertices.cols(), 2);
}

TEST(BeamJobs, BadOnesNameTheMember) {
  const auto spoiled = [](const std::string& from, const std::string& to) {
    std::string text = kJob;
    text.replace(text.find(from), from.size(), to);
    return field_of([&] { (void)read_beam_job(text); });
  };
  EXPECT_EQ(spoiled("[0,[0,1,2]]", "[0,[0,1,6]]"), "fixed vertices[0]");
  EXPECT_EQ(spoiled("[0,[0,1,2]]", "[-1,[0]]"), "fixed vertices[0]");
  EXPECT_EQ(spoiled("[1,2,3,4,5,6]", "[1,2,3]"), "forces[0]");
  EXPECT_EQ(spoiled("-0.2", "null"), "forced displacements[0]");
  EXPECT_EQ(spoiled("\"beam material\":[0.3,1e9],", ""), "beam material");
  EXPECT_EQ(spoiled("[0.02,0.03]", "0.02"), "cross section dim");
  EXPECT_EQ(spoiled("\"frame.ply\"", "3"), "mesh filename");
  EXPECT_EQ(spoiled("\"mesh filename\":\"frame.ply\",", ""), "mesh filename");
  EXPECT_EQ(field_of([] { (void)read_beam_job("{"); }), "SimulationJob.json");
  EXPECT_EQ(field_of([] { (void)read_beam_job(kJob, "[]"); }), "DRMSettings.json");
}

TEST(BeamJobs, ThePublicStructures) {
  const auto folder = testing::shared_body("").parent_path().parent_path() / "beams";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data";
  const struct {
    const char* name;
    int nodes;
    std::size_t elements, displacements;
  } cases[] = {{"cantilever", 11, 10, 0},
               {"torus", 464, 870, 116},
               {"pentashell_pinned", 597, 1146, 5},
               {"roof", 441, 848, 29}};
  for (const auto& c : cases) {
    const BeamJobFiles files = read_beam_job_folder(folder / c.name);
    EXPECT_EQ(files.mesh.vertices.cols(), c.nodes);
    EXPECT_EQ(files.mesh.edges.size(), c.elements);
    EXPECT_EQ(files.job.displacements.size(), c.displacements);
  }
}

}  // namespace
}  // namespace limber::scene
