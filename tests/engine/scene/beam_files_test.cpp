#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/scene/formats/edge_formats.h"
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
"unknown":{}})";

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
  EXPECT_EQ(spoiled("\"beam material\"", "\"material\""), "beam material");
  EXPECT_EQ(spoiled("[0.02,0.03]", "0.02"), "cross section dim");
  EXPECT_EQ(spoiled("\"frame.ply\"", "3"), "mesh filename");
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
