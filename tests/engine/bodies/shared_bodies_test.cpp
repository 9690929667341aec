#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "engine/bodies/mesh_validation.h"
#include "engine/bodies/modal_analysis.h"
#include "tests/engine/bodies/modal_checks.h"

namespace limber::bodies {
namespace {

std::filesystem::path shared_body(const std::string& name) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path folder = root ? root : LIMBER_SOURCE_DIR "/../shared";
  return folder / "data" / "bodies" / name;
}

TetMesh mesh_of(const std::vector<double>& coordinates, const std::vector<int>& labels) {
  TetMesh mesh;
  mesh.nodes = Eigen::Map<const NodePositions>(coordinates.data(), 3,
                                               static_cast<Eigen::Index>(coordinates.size()) / 3);
  mesh.tets =
      Eigen::Map<const TetNodes>(labels.data(), 4, static_cast<Eigen::Index>(labels.size()) / 4)
          .array() -
      1;
  mesh.materials = {Material{}};
  mesh.tet_material.assign(static_cast<std::size_t>(mesh.tet_count()), 0);
  return mesh;
}

// Only what these two files use; the readers for users are in engine/scene.
TetMesh read_gmsh_4_1(std::istream& in) {
  std::string word;
  std::vector<double> coordinates;
  std::vector<int> labels;
  while (in >> word && word != "$Nodes") {
  }
  int blocks = 0, count = 0, low = 0, high = 0, skip = 0;
  in >> blocks >> count >> low >> high >> skip >> skip >> skip >> count;
  for (int i = 0; i < count; ++i) in >> skip;
  coordinates.resize(3 * static_cast<std::size_t>(count));
  for (double& value : coordinates) in >> value;
  while (in >> word && word != "$Elements") {
  }
  in >> blocks >> count >> low >> high >> skip >> skip >> skip >> count;
  labels.resize(4 * static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (i % 4 == 0) in >> skip;
    in >> labels[i];
  }
  EXPECT_TRUE(in.good());
  return mesh_of(coordinates, labels);
}

TetMesh read_abaqus(std::istream& in) {
  std::vector<double> coordinates;
  std::vector<int> labels;
  std::string line;
  int section = 0;
  while (std::getline(in, line)) {
    if (line.starts_with("*")) {
      section = line.starts_with("*NODE") ? 1 : line.starts_with("*ELEMENT") ? 2 : 0;
      continue;
    }
    const char* text = line.c_str();
    char* rest = nullptr;
    std::strtod(text, &rest);
    for (int k = 0; k < section + 2 && section > 0 && *rest == ','; ++k) {
      const double value = std::strtod(rest + 1, &rest);
      if (section == 1) coordinates.push_back(value);
      if (section == 2) labels.push_back(static_cast<int>(value));
    }
  }
  return mesh_of(coordinates, labels);
}

void expect_sound_modes(const TetMesh& source) {
  const PreparedMesh prepared = prepare_mesh(source, {});
  ASSERT_EQ(prepared.warnings.size(), 1u);
  EXPECT_NE(prepared.warnings[0].find("poor shape"), std::string::npos) << prepared.warnings[0];
  ElasticBody body{prepared.mesh, {}};
  ModalOptions options;
  options.mode_count = 30;
  for (const bool held : {false, true}) {
    if (held) {
      const double low = body.mesh.nodes.row(1).minCoeff();
      for (int a = 0; a < body.mesh.node_count(); ++a) {
        if (body.mesh.nodes(1, a) < low + 0.05 * body.length()) body.fixed_nodes.push_back(a);
      }
    }
    const ModalBasis basis = modal_analysis(body, options);
    EXPECT_EQ(basis.rigid_count, held ? 0 : 6);
    EXPECT_EQ(basis.mechanism_count, 0);
    EXPECT_LT(basis.max_residual, 1e-7);
    EXPECT_LT(testing::worst_energy_residual(body, basis), 1e-7);
    testing::expect_orthonormal(body, basis);
  }
}

TEST(SharedBodies, Dolphin5KWithSlivers) {
  std::ifstream file(shared_body("dolphin5K.msh"));
  if (!file) GTEST_SKIP() << "no dolphin5K.msh in the shared data";
  const TetMesh mesh = read_gmsh_4_1(file);
  ASSERT_EQ(mesh.tet_count(), 36304);
  expect_sound_modes(mesh);
}

TEST(SharedBodies, OctopusWithSlivers) {
  std::ifstream file(shared_body("octopus.abq"));
  if (!file) GTEST_SKIP() << "no octopus.abq in the shared data";
  const TetMesh mesh = read_abaqus(file);
  ASSERT_EQ(mesh.tet_count(), 13403);
  expect_sound_modes(mesh);
}

}  // namespace
}  // namespace limber::bodies
