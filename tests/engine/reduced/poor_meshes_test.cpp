#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "engine/bodies/mesh_validation.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/rs_inverse.h"
#include "engine/scene/formats/mesh_formats.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

/// u -> y -> u of a body with slivers, bent and turned, up to its translation.
void expect_comes_back(const char* file) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
  const std::filesystem::path path = shared / "data" / "bodies" / file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  bodies::ElasticBody body;
  body.mesh = bodies::prepare_mesh(scene::read_mesh_file(path).mesh, {}).mesh;
  body.mesh.materials = {{}};
  body.mesh.tet_material.assign(static_cast<std::size_t>(body.mesh.tet_count()), 0);
  const FullReconstruction full(body);
  const RsInverse inverse(body, full.gradient());
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::VectorXd u = testing::moved(body, testing::smooth_field(body, 0.1, 5), turn,
                                           Eigen::Vector3d::Constant(body.length()));
  const Eigen::VectorXd y = inverse.coordinates(u);
  ASSERT_TRUE(y.allFinite());
  Eigen::Matrix3Xd miss = testing::by_node(full.from_coordinates(y)) - testing::by_node(u);
  miss.colwise() -= miss.rowwise().mean().eval();
  EXPECT_LT(miss.norm(), 1e-9 * u.norm());
}

TEST(PoorMeshes, Dolphin) { expect_comes_back("dolphin5K.msh"); }
TEST(PoorMeshes, Octopus) { expect_comes_back("octopus.abq"); }

}  // namespace
}  // namespace limber::reduced
