#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/scene/formats/mesh_formats.h"
#include "server/kinds/bodies/scene.h"

namespace limber::server {

/// Where meshes come from that are named, not sent.
class MeshSources {
 public:
  /// @param roots  folders below which MeshSource.path may name files
  explicit MeshSources(std::vector<std::filesystem::path> roots, scene::MeshReadLimits limits = {})
      : roots_(std::move(roots)), limits_(limits) {}

  /// Path, file or sample. @throws Refusal or Error naming `field` + ".path", ...
  [[nodiscard]] LoadedMesh load(const proto::MeshSource& source, const std::string& field) const;

  /// The one existing file below a root that `path` means. Nothing outside is reached, by .. or
  /// symbolic links, and whether it exists is not told.
  /// @throws Refusal NOT_FOUND naming `field`
  [[nodiscard]] std::filesystem::path resolve(const std::string& path,
                                              const std::string& field) const;

 private:
  std::vector<std::filesystem::path> roots_;
  scene::MeshReadLimits limits_;
};

/// A file of this machine, with what lies beside it. @throws Error naming `field`
[[nodiscard]] LoadedMesh load_mesh_file(const std::filesystem::path& file, const std::string& field,
                                        const scene::MeshReadLimits& limits = {});

/// The bytes of a file of this machine. @throws Error naming `field`
[[nodiscard]] std::string read_file_at(const std::filesystem::path& file, const std::string& field);

/// An uploaded file with its companions.
[[nodiscard]] scene::MeshFileSet file_set(const proto::MeshFile& file);

}  // namespace limber::server
