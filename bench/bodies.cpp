#include <algorithm>
#include <filesystem>

#include "bench/public_body.h"
#include "bench/suite.h"
#include "engine/base/error.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/samples/samples.h"
#include "tests/support/material_bodies.h"

namespace limber::bench {
namespace {

NamedBody prepare(std::string name, bodies::TetMesh mesh, const bodies::Material& material,
                  const std::vector<int>& fixed_nodes) {
  bodies::PreparedMesh prepared = bodies::prepare_mesh(mesh, fixed_nodes);
  NamedBody result;
  result.name = std::move(name);
  result.body.mesh = std::move(prepared.mesh);
  if (result.body.mesh.materials.empty()) {
    result.body.mesh.materials = {material};
    result.body.mesh.tet_material.assign(static_cast<std::size_t>(result.body.mesh.tet_count()), 0);
  }
  for (const int node : fixed_nodes) {
    result.body.fixed_nodes.push_back(prepared.compact_of_source[static_cast<std::size_t>(node)]);
  }
  std::sort(result.body.fixed_nodes.begin(), result.body.fixed_nodes.end());
  const auto last = std::unique(result.body.fixed_nodes.begin(), result.body.fixed_nodes.end());
  result.body.fixed_nodes.erase(last, result.body.fixed_nodes.end());
  result.compact_of_source = std::move(prepared.compact_of_source);
  return result;
}

std::vector<int> lowest_nodes(const bodies::TetMesh& mesh, double fraction) {
  const auto heights = mesh.nodes.row(1);
  const double limit = heights.minCoeff() + fraction * (heights.maxCoeff() - heights.minCoeff());
  std::vector<bool> used(static_cast<std::size_t>(mesh.node_count()), false);
  for (Eigen::Index i = 0; i < mesh.tets.size(); ++i)
    used[static_cast<std::size_t>(mesh.tets.data()[i])] = true;
  std::vector<int> nodes;
  for (int i = 0; i < mesh.node_count(); ++i) {
    if (heights[i] <= limit && used[static_cast<std::size_t>(i)]) nodes.push_back(i);
  }
  return nodes;
}

}  // namespace

NamedBody body_of_scene(const scene::Scene& scene) {
  bodies::TetMesh mesh = scene.mesh;
  mesh.nodes *= scene.length_unit_in_metres;
  return prepare(scene.name, std::move(mesh), scene.material, scene.fixed_nodes);
}

std::optional<NamedBody> load_body(const std::string& name, const SuiteOptions& options) {
  const std::filesystem::path folder =
      std::filesystem::path(options.shared_folder) / "data" / "bodies";
  if (std::filesystem::exists(folder / name / "mesh.abq")) {
    bodies::TetMesh mesh = scene::read_mesh_file(folder / name / "mesh.abq").mesh;
    // Bases are built from uniform material, as in the paper (section 3.1).
    mesh.materials.clear();
    mesh.tet_material.clear();
    return prepare(name, std::move(mesh), bodies::Material{},
                   testing::read_node_list(folder / name / "con_nodes.bou"));
  }
  for (const char* ending : {".msh", ".abq"}) {
    const std::filesystem::path path = folder / (name + ending);
    if (!std::filesystem::exists(path)) continue;
    bodies::TetMesh mesh = scene::read_mesh_file(path).mesh;
    const std::vector<int> fixed = lowest_nodes(mesh, 0.05);
    return prepare(name, std::move(mesh), bodies::Material{}, fixed);
  }
  const auto samples = scene::sample_names();
  if (std::find(samples.begin(), samples.end(), name) == samples.end()) return std::nullopt;
  return body_of_scene(scene::make_sample(name));
}

std::optional<scene::Scene> public_body(const testing::BodyFile& file, const std::string& suite,
                                        int most_quick_tets, const SuiteOptions& options,
                                        Recorder& recorder) {
  const auto folder = std::filesystem::path(options.shared_folder) / "data" / "bodies";
  std::optional<scene::Scene> body = testing::read_body(file, folder);
  if (!body) {
    recorder.note(suite + ": " + file.name + " left out, the public data is not there");
  } else if (options.quick && body->mesh.tet_count() > most_quick_tets) {
    recorder.note(suite + ": " + file.name + " left out by --quick");
    body.reset();
  }
  return body;
}

}  // namespace limber::bench
