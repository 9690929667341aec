#include "clients/cpp/bodies/scene_files.h"

#include <charconv>
#include <cstdint>
#include <cstring>
#include <vector>

#include "clients/cpp/bodies/motion_files.h"
#include "clients/cpp/files.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

template <class Number>
std::vector<Number> raw_numbers(const v1::Array& array) {
  std::vector<Number> values(array.data().size() / sizeof(Number));
  if (!values.empty())
    std::memcpy(values.data(), array.data().data(), values.size() * sizeof(Number));
  return values;
}

/// Gmsh MSH 2.2, ASCII: every tool reads it.
std::string msh(const v1::MeshArrays& mesh) {
  std::vector<double> nodes;
  if (mesh.nodes().type() == v1::DATA_TYPE_FLOAT32) {
    const auto floats = raw_numbers<float>(mesh.nodes());
    nodes.assign(floats.begin(), floats.end());
  } else {
    nodes = raw_numbers<double>(mesh.nodes());
  }
  const auto tets = raw_numbers<std::int32_t>(mesh.tets());
  std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes.size() / 3) + "\n";
  char digits[32];
  for (std::size_t i = 0; i + 2 < nodes.size(); i += 3) {
    text += std::to_string(i / 3 + 1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto end = std::to_chars(digits, digits + sizeof digits, nodes[i + axis]).ptr;
      text.append(1, ' ').append(digits, end);
    }
    text += '\n';
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(tets.size() / 4) + "\n";
  for (std::size_t i = 0; i + 3 < tets.size(); i += 4) {
    text += std::to_string(i / 4 + 1) + " 4 0";
    for (std::size_t corner = 0; corner < 4; ++corner)
      text.append(1, ' ').append(std::to_string(tets[i + corner] + 1));
    text += '\n';
  }
  return text + "$EndElements\n";
}

}  // namespace

void put_mesh_bytes(v1::Scene& scene, const fs::path& folder) {
  if (!scene.mesh().has_path()) return;
  *scene.mutable_mesh()->mutable_file() = mesh_file(folder / scene.mesh().path());
}

void put_pose_bytes(v1::Scene& scene, const fs::path& folder) {
  for (int i = 0; i < scene.keyframes_size(); ++i) {
    auto& keyframe = *scene.mutable_keyframes(i);
    if (!keyframe.has_path()) continue;
    *keyframe.mutable_file() =
        mesh_file(folder / keyframe.path(), "keyframes[" + std::to_string(i) + "].path");
  }
  if (scene.has_base_motion()) put_motion_bytes(*scene.mutable_base_motion(), folder);
}

v1::PaintedStiffness painted_stiffness(const fs::path& path, const std::string& field) {
  v1::PaintedStiffness painted;
  painted.mutable_file()->set_name(path.filename().string());
  painted.mutable_file()->set_content(read_bytes(path, field));
  return painted;
}

void put_stiffness_bytes(v1::Scene& scene, const fs::path& folder) {
  if (!scene.painted_stiffness().has_path()) return;
  auto& painted = *scene.mutable_painted_stiffness();
  *painted.mutable_file() = painted_stiffness(folder / painted.path()).file();
}

void save_mesh(v1::Scene& scene, const std::string& name, const fs::path& folder) {
  if (scene.mesh().has_file()) {
    const v1::MeshFile file = scene.mesh().file();
    for (const auto& [companion, content] : file.companions())
      write_bytes(folder / fs::path(companion).filename(), content);
    const std::string mesh_name = fs::path(file.name()).filename().string();
    write_bytes(folder / mesh_name, file.content());
    scene.mutable_mesh()->set_path(mesh_name);
  } else if (scene.mesh().has_arrays()) {
    write_bytes(folder / (name + ".msh"), msh(scene.mesh().arrays()));
    scene.mutable_mesh()->set_path(name + ".msh");
  }
}

}  // namespace limber::client
