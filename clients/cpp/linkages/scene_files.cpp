#include "clients/cpp/linkages/scene_files.h"

#include "clients/cpp/files.h"

namespace limber::client {

void put_linkage_bytes(v1::Scene& scene, const std::filesystem::path& folder) {
  if (!scene.linkage().lines().has_path()) return;
  auto& lines = *scene.mutable_linkage()->mutable_lines();
  *lines.mutable_file() = mesh_file(folder / lines.path(), "linkage.lines.path");
}

}  // namespace limber::client
