#include "clients/cpp/bodies/plain_files.h"

#include <fmt/format.h>

#include <utility>

#include "clients/cpp/bodies/surface_files.h"
#include "clients/cpp/files.h"
#include "clients/cpp/material_words.h"

namespace limber::client {
namespace {

v1::Scene plain_scene(const std::string& name) {
  v1::Scene scene;
  scene.set_name(name);
  scene.set_frames(kFramesOfPlainFiles);
  return scene;
}

}  // namespace

v1::Scene scene_of_tets(const std::filesystem::path& path) {
  v1::Scene scene = plain_scene(path.stem().string());
  *scene.mutable_mesh()->mutable_file() = mesh_file(path);
  if (const auto surface = surface_beside(path))
    *scene.mutable_surface()->mutable_file() = surface_file(*surface, "surface.path");
  return scene;
}

v1::Scene scene_of_tets(const std::string& name, v1::MeshArrays mesh) {
  v1::Scene scene = plain_scene(name);
  *scene.mutable_mesh()->mutable_arrays() = std::move(mesh);
  return scene;
}

std::string body_assumptions(const v1::Scene& scene) {
  return fmt::format("an elastic body of which nothing is fixed, {} frames at {:.4g} a second; {}",
                     scene.frames(), scene.dynamics().frames_per_second(),
                     material_words(scene.material(), scene.length_unit_in_metres()));
}

}  // namespace limber::client
