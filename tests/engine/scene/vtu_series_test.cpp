#include "engine/scene/formats/vtu_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/mesh_writers.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

bodies::TetMesh two_tets() {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, 5);
  mesh.nodes << 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1;
  mesh.tets.resize(4, 2);
  mesh.tets << 0, 1, 1, 4, 2, 2, 3, 3;
  return mesh;
}

std::vector<VtuFrame> series(int frames, const Eigen::MatrixXd& displacements) {
  std::vector<VtuFrame> files;
  for (int i = 0; i < frames; ++i) {
    files.push_back({"m_" + std::to_string(i) + ".vtu",
                     write_vtu_frame(two_tets(), displacements.col(i), Precision::kFloat64)});
  }
  return files;
}

Eigen::MatrixXd read_series(const std::vector<VtuFrame>& files, Eigen::Index nodes = 5) {
  return read_vtu_series(
      "motion", files.size(), [&](std::size_t i) { return files[i]; }, nodes);
}

std::string series_refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "motion");
    return error.what();
  }
  return "accepted";
}

TEST(VtuSeries, FramesAreThePointsOfTheFiles) {
  const Eigen::MatrixXd displacements = Eigen::MatrixXd::Random(15, 4);
  const Eigen::MatrixXd positions = read_series(series(4, displacements));
  const bodies::TetMesh mesh = two_tets();
  const Eigen::Map<const Eigen::VectorXd> rest(mesh.nodes.data(), 15);
  ASSERT_EQ(positions.cols(), 4);
  EXPECT_LT((positions.colwise() - rest - displacements).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(read_series(series(4, displacements), 0), positions);  // nodes as many as the first has
}

TEST(VtuSeries, FilesOfOtherProgramsAreRead) {
  std::vector<VtuFrame> files;
  for (const char* name : {"vtu_ascii.vtu", "vtu_binary.vtu", "vtu_zlib.vtu"})
    files.push_back({name, read_bytes(testing::fixture(name))});
  const Eigen::MatrixXd positions = read_series(files, 0);
  const bodies::TetMesh mesh = read_mesh_file(testing::fixture("vtu_ascii.vtu")).mesh;
  ASSERT_EQ(positions.rows(), mesh.nodes.size());
  for (int i = 0; i < 3; ++i)
    EXPECT_LT((positions.col(i) - mesh.nodes.reshaped()).cwiseAbs().maxCoeff(), 1e-6) << i;
}

TEST(VtuSeries, FaultsNameFrameAndFile) {
  const Eigen::MatrixXd displacements = Eigen::MatrixXd::Random(15, 4);
  auto files = series(4, displacements);
  EXPECT_THAT(series_refusal([&] { (void)read_series(files, 6); }),
              HasSubstr("frame 0 (m_0.vtu) has 5 points, the mesh has 6 nodes"));
  files[2] = {"odd.vtu", read_bytes(testing::fixture("vtu_ascii.vtu"))};
  EXPECT_THAT(series_refusal([&] { (void)read_series(files); }),
              HasSubstr("frame 2 (odd.vtu) has 12 points"));
  files[2].content = files[2].content.substr(0, 500);
  EXPECT_THAT(series_refusal([&] { (void)read_series(files); }),
              HasSubstr("frame 2 (odd.vtu): odd.vtu:"));
  Eigen::MatrixXd broken = displacements;
  broken(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(series_refusal([&] { (void)read_series(series(4, broken)); }),
              HasSubstr("frame 1 (m_1.vtu): point 1 is not finite"));
  EXPECT_THAT(series_refusal([&] { (void)read_series({}); }), HasSubstr("no frames"));
}

TEST(VtuSeries, PvdFilesAreInTheOrderOfTime) {
  EXPECT_THAT(pvd_files("motion", write_pvd({"a.vtu", "b.vtu", "sub/c&d.vtu"}, {0.2, 0, 0.1})),
              ElementsAre("b.vtu", "sub/c&d.vtu", "a.vtu"));
  const std::string untimed =
      "<VTKFile type=\"Collection\"><Collection><DataSet file=\"y.vtu\"/><DataSet file=\"x.vtu\"/>"
      "</Collection></VTKFile>";
  EXPECT_THAT(pvd_files("motion", untimed), ElementsAre("y.vtu", "x.vtu"));
}

TEST(VtuSeries, BadPvdFilesAreRefused) {
  const auto message = [](const std::string& text) {
    return series_refusal([&] { (void)pvd_files("motion", text); });
  };
  EXPECT_THAT(message("nonsense"), HasSubstr("XML"));
  EXPECT_THAT(message("<VTKFile type=\"UnstructuredGrid\"/>"), HasSubstr("Collection"));
  EXPECT_THAT(message("<VTKFile type=\"Collection\"><Collection/></VTKFile>"),
              HasSubstr("no files"));
  EXPECT_THAT(message(write_pvd({"a.vtu", ""}, {0, 1})), HasSubstr("DataSet 1 names no file"));
  EXPECT_THAT(message(write_pvd({"a.vtu", "b.vtu"}, {1, 1})), HasSubstr("a.vtu and b.vtu"));
  EXPECT_THAT(message(write_pvd({"a.vtu", "b.vtu", "a.vtu"}, {0, 1, 2})),
              HasSubstr("a.vtu is listed for two times"));
}

}  // namespace
}  // namespace limber::scene
