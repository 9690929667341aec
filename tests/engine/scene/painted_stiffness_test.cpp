#include "engine/scene/painted_stiffness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/base/error.h"
#include "engine/scene/formats/stiffness_files.h"
#include "engine/scene/samples/samples.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

constexpr auto kFactor = StiffnessQuantity::kFactor;
constexpr auto kModulus = StiffnessQuantity::kYoungsModulus;
const bodies::Material kSoft{1e5, 0.3, 800};

/// Two tets on a common face, nodes 1 to 3.
bodies::TetMesh two_tets() {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, 5);
  mesh.nodes << 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1;
  mesh.tets.resize(4, 2);
  mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  return mesh;
}

std::vector<PaintedStiffness> factors(std::initializer_list<double> values) {
  std::vector<PaintedStiffness> painted;
  for (const double value : values) painted.push_back({value, kFactor});
  return painted;
}

Error refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  return Error(ErrorCode::kInternal, "", "nothing was refused");
}

TEST(PaintedStiffness, ATetGetsTheGeometricMeanOfItsNodes) {
  bodies::TetMesh mesh = two_tets();
  paint_nodes(factors({1, 1, 100, 100, 16}), kSoft, mesh);
  EXPECT_NEAR(mesh.material_of(0).youngs_modulus, 1e6, 1e-6);  // 1e5 (1 1 100 100)^(1/4)
  EXPECT_NEAR(mesh.material_of(1).youngs_modulus, 2e6, 1e-6);  // 1e5 (1 100 100 16)^(1/4)
  EXPECT_EQ(mesh.material_of(1).poissons_ratio, 0.3);
  EXPECT_EQ(mesh.material_of(1).density, 800);
}

TEST(PaintedStiffness, ModuliReplaceThoseOfTheMaterial) {
  bodies::TetMesh mesh = two_tets();
  auto painted = factors({1, 1, 1, 1, 1});
  painted[0] = {16e5, kModulus};
  paint_nodes(painted, kSoft, mesh);
  EXPECT_NEAR(mesh.material_of(0).youngs_modulus, 2e5, 1e-7);  // (16e5 1e5 1e5 1e5)^(1/4)
  EXPECT_EQ(mesh.material_of(1), kSoft);                       // to the last bit
}

TEST(PaintedStiffness, MaterialsOfTheMeshAreMultiplied) {
  bodies::TetMesh mesh = two_tets();
  mesh.materials = {{1e5, 0.2, 100}, {1e6, 0.4, 200}};
  mesh.tet_material = {1, 0};
  paint_nodes(factors({3, 3, 3, 3, 3}), kSoft, mesh);
  EXPECT_NEAR(mesh.material_of(0).youngs_modulus, 3e6, 1e-6);
  EXPECT_EQ(mesh.material_of(0).density, 200);
  EXPECT_NEAR(mesh.material_of(1).youngs_modulus, 3e5, 1e-7);
  EXPECT_EQ(mesh.material_of(1).poissons_ratio, 0.2);
}

TEST(PaintedStiffness, ATetOfAFilledSurfaceGetsItsNearestVertex) {
  const Scene dino = make_sample("dino");
  bodies::TetMesh mesh = dino.mesh;
  mesh.materials.clear();
  mesh.tet_material.clear();
  const Eigen::Matrix3Xd vertices = dino.mesh.nodes.leftCols(200);
  std::vector<PaintedStiffness> painted;
  for (int i = 0; i < 200; ++i) painted.push_back({1.0 + i, kFactor});
  paint_surface(vertices, painted, kSoft, mesh);
  ASSERT_EQ(mesh.tet_material.size(), static_cast<std::size_t>(mesh.tet_count()));
  for (int tet = 0; tet < mesh.tet_count(); ++tet) {
    Eigen::Vector3d centre(0, 0, 0);
    for (int corner = 0; corner < 4; ++corner) centre += mesh.nodes.col(mesh.tets(corner, tet)) / 4;
    const Eigen::VectorXd distances = (vertices.colwise() - centre).colwise().norm();
    const auto vertex =
        static_cast<Eigen::Index>(std::lround(mesh.material_of(tet).youngs_modulus / 1e5 - 1));
    ASSERT_NEAR(mesh.material_of(tet).youngs_modulus, 1e5 * (1.0 + static_cast<double>(vertex)),
                1e-6);
    // Of vertices that are equally near but for rounding, either will do.
    ASSERT_LE(distances(vertex), distances.minCoeff() * (1 + 1e-12)) << tet;
  }
}

TEST(PaintedStiffness, ManyModuliAreRoundedInEqualRatios) {
  bodies::TetMesh mesh = make_sample("dino").mesh;
  mesh.materials.clear();
  mesh.tet_material.clear();
  bodies::TetMesh exact = mesh;
  std::vector<PaintedStiffness> painted;
  for (int node = 0; node < mesh.node_count(); ++node)
    painted.push_back({std::exp(2.0 * std::sin(0.37 * node)), kFactor});
  paint_nodes(painted, kSoft, mesh);
  EXPECT_GT(mesh.materials.size(), 100);
  EXPECT_LE(mesh.materials.size(), static_cast<std::size_t>(kMaxPaintedMaterials));
  std::set<int> used(mesh.tet_material.begin(), mesh.tet_material.end());
  EXPECT_EQ(used.size(), mesh.materials.size());
  // A step is at most the whole range, a ratio of e^4, in 255 parts: half of that is 0.8 %.
  for (int tet = 0; tet < mesh.tet_count(); ++tet) {
    double sum = 0;
    for (int corner = 0; corner < 4; ++corner)
      sum += 2.0 * std::sin(0.37 * mesh.tets(corner, tet)) / 4;
    EXPECT_NEAR(mesh.material_of(tet).youngs_modulus / (1e5 * std::exp(sum)), 1, 0.0081);
  }
}

TEST(PaintedStiffness, FaultyValuesAreNamed) {
  bodies::TetMesh mesh = two_tets();
  const auto field = [&](const std::vector<PaintedStiffness>& painted) {
    return refusal([&] { paint_nodes(painted, kSoft, mesh); }).field();
  };
  EXPECT_EQ(field(factors({1, 1, 1, 1})), "values");
  EXPECT_EQ(field(factors({1, 1, 0, 1, 1})), "values[2]");
  EXPECT_EQ(field(factors({1, 1, 1, 1, -1})), "values[4]");
  EXPECT_EQ(field(factors({1, std::nan(""), 1, 1, 1})), "values[1]");
  EXPECT_TRUE(mesh.materials.empty());
  mesh.tets(0, 0) = 9;  // which validation reports
  paint_nodes(factors({1, 1, 1, 1, 2}), kSoft, mesh);
  EXPECT_TRUE(mesh.materials.empty());
}

TEST(StiffnessFiles, TextsHaveANumberForEachPoint) {
  const auto painted =
      read_stiffness("a.txt", "# five\n1, 2.5\n\n1e3 4\t5 # the last\n", kModulus, 5);
  ASSERT_EQ(painted.size(), 5);
  EXPECT_EQ(painted[2].value, 1000);
  EXPECT_EQ(painted[2].quantity, kModulus);
  const auto why = [](const std::string& content) {
    return std::string(refusal([&] { (void)read_stiffness("a.txt", content, kFactor, 2); }).what());
  };
  EXPECT_THAT(why("1 2 3"), HasSubstr("a.txt:1: 3 numbers are given for 2 points"));
  EXPECT_THAT(why("1\nsoft\n"), HasSubstr("a.txt:2: expected a number for a point, found 'soft'"));
  EXPECT_THAT(why(""), HasSubstr("0 numbers are given for 2 points"));
}

TEST(StiffnessFiles, PropertiesOfPlyAreRead) {
  for (const std::string name : {"stiffness", "quality", "value", "scalar_weight"}) {
    const auto painted = read_stiffness(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float " + name +
            "\nproperty list uchar int vertex_indices\nend_header\n0 1.5 2 1 1\n1 2.5 0\n",
        kFactor, 2);
    EXPECT_EQ(painted[0].value, 1.5);
    EXPECT_EQ(painted[1].value, 2.5);
  }
  const Error error = refusal([] {
    (void)read_stiffness(
        "a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
        kFactor, 1);
  });
  EXPECT_THAT(error.what(), HasSubstr("no property stiffness"));
}

TEST(StiffnessFiles, GroupsNameTheirVertices) {
  const auto painted = read_stiffness(
      "g.json",
      R"({"groups":{"arm":{"vertices":[3,0],"factor":10},"head":{"vertices":[1],"youngs_modulus":2e6}}})",
      kFactor, 4);
  EXPECT_EQ(painted[0].value, 10);
  EXPECT_EQ(painted[3].value, 10);
  EXPECT_EQ(painted[1].value, 2e6);
  EXPECT_EQ(painted[1].quantity, kModulus);
  EXPECT_EQ(painted[2].value, 1);
  EXPECT_EQ(painted[2].quantity, kFactor);
  const auto why = [](const std::string& group) {
    return std::string(refusal([&] {
                         (void)read_stiffness("g.json", R"({"groups":{"a":)" + group + "}}",
                                              kFactor, 4);
                       }).what());
  };
  EXPECT_THAT(why(R"({"vertices":[4],"factor":1})"), HasSubstr("a vertex that is none of 4"));
  EXPECT_THAT(why(R"({"vertices":[-1],"factor":1})"), HasSubstr("a vertex that is none of 4"));
  EXPECT_THAT(why(R"({"vertices":[1.5],"factor":1})"), HasSubstr("a vertex that is none of 4"));
  EXPECT_THAT(why(R"({"vertices":[1,1],"factor":1})"), HasSubstr("in a group before"));
  EXPECT_THAT(why(R"({"vertices":[1]})"), HasSubstr("neither factor nor youngs_modulus"));
  EXPECT_THAT(why(R"({"factor":1})"), HasSubstr("no list of vertices"));
  EXPECT_THAT(why(R"({"vertices":[1],"factors":1})"), HasSubstr("has the key 'factors'"));
  EXPECT_THAT(why(R"({"vertices":[1],"factor":1,"youngs_modulus":1})"), HasSubstr("one number"));
  EXPECT_THAT(why("{"), HasSubstr("is not JSON"));
}

}  // namespace
}  // namespace limber::scene
