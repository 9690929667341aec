#include "engine/scene/samples/samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/scene/tetrahedralize/mesh_quality.h"

namespace limber::scene {
namespace {

class Samples : public ::testing::TestWithParam<std::string> {};

TEST_P(Samples, AreValidAndWellShaped) {
  const Scene scene = make_sample(GetParam());
  EXPECT_EQ(scene.name, GetParam());
  for (const Issue& issue : validate(scene)) ADD_FAILURE() << issue.field << ": " << issue.message;
  const bodies::PreparedMesh prepared = bodies::prepare_mesh(scene.mesh, scene.fixed_nodes);
  EXPECT_EQ(prepared.piece_count, 1);
  EXPECT_TRUE(prepared.repairs.empty());
  EXPECT_TRUE(prepared.warnings.empty());
  const MeshQuality quality = measure_quality(scene.mesh);
  // The beam has the paper's own cells of 6.5 : 2.3 : 1.
  EXPECT_GT(quality.min_mean_ratio, GetParam() == "beam" ? 0.2 : 0.4);
  EXPECT_GT(quality.min_dihedral_deg, GetParam() == "beam" ? 8 : 18);
  const Eigen::Vector3d size =
      scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff();
  EXPECT_GT(size.maxCoeff(), 0.5);
  EXPECT_LT(size.maxCoeff(), 2);
  for (const Constraint& constraint : scene.constraints) {
    EXPECT_GT(constraint.target.norm(), 0.05 * size.maxCoeff());
    EXPECT_LT(constraint.target.norm(), 0.6 * size.maxCoeff());
  }
}

TEST_P(Samples, AreTheSameBitsEveryTime) {
  const Scene a = make_sample(GetParam()), b = make_sample(GetParam());
  EXPECT_EQ(a.mesh.nodes, b.mesh.nodes);
  EXPECT_EQ(a.mesh.tets, b.mesh.tets);
  EXPECT_EQ(a.fixed_nodes, b.fixed_nodes);
}

INSTANTIATE_TEST_SUITE_P(All, Samples, ::testing::ValuesIn(sample_names()),
                         [](const auto& test) { return test.param; });

TEST(SampleScenes, HaveTheSizesOfThePapersTable) {
  const struct {
    const char* name;
    int tets;
    double within;
    int frames;
    std::size_t constraints;
  } expected[] = {{"beam", 6144, 0, 150, 4},
                  {"flower", 5000, 0.04, 380, 20},
                  {"bird", 3100, 0.04, 150, 6},
                  {"dino", 5200, 0.04, 620, 6}};
  for (const auto& e : expected) {
    const Scene scene = make_sample(e.name);
    EXPECT_NEAR(scene.mesh.tet_count(), e.tets, e.within * e.tets) << e.name;
    EXPECT_EQ(scene.frame_count, e.frames);
    EXPECT_EQ(scene.constraints.size(), e.constraints);
    EXPECT_EQ(scene.model.mode_count, 30);
  }
  EXPECT_EQ(make_sample("beam").mesh.node_count(), 1377);
  EXPECT_EQ(make_sample("beam").fixed_nodes.size(), 162);
}

TEST(SampleScenes, TheFlowersConstraintsAreACircleOfItsTop) {
  const Scene flower = make_sample("flower");
  EXPECT_EQ(flower.constraints.front().frame, 30);
  EXPECT_EQ(flower.constraints.back().frame, 125);
  const double radius = flower.constraints[0].target.head<1>().norm();
  for (const Constraint& c : flower.constraints) {
    EXPECT_EQ(c.nodes, flower.constraints[0].nodes);
    EXPECT_NEAR(std::hypot(c.target[0], c.target[2]), radius, 1e-12);
  }
}

TEST(SampleScenes, UnknownNamesAreRefusedWithTheKnownOnes) {
  try {
    static_cast<void>(make_sample("teapot"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("beam, flower, bird, dino"));
  }
}

}  // namespace
}  // namespace limber::scene
