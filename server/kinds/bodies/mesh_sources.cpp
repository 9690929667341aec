#include "server/kinds/bodies/mesh_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/scene/samples/samples.h"
#include "server/wire/abbreviate.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& path, const fs::path& root) {
  const auto [end, at] = std::mismatch(root.begin(), root.end(), path.begin(), path.end());
  return end == root.end() && at != path.end();
}

std::optional<fs::path> below(const fs::path& root, const fs::path& wanted) {
  std::error_code fault;
  const fs::path home = fs::canonical(root, fault);
  if (fault) return std::nullopt;
  const fs::path file = fs::canonical(wanted.is_absolute() ? wanted : home / wanted, fault);
  if (fault || !is_below(file, home) || !fs::is_regular_file(file, fault)) return std::nullopt;
  // Readers open companions in the same folder: none of those may lead out either.
  for (const auto& entry : fs::directory_iterator(file.parent_path(), fault)) {
    if (!entry.is_symlink(fault)) continue;
    const fs::path target = fs::canonical(entry.path(), fault);
    if (!fault && !is_below(target, home) && fs::is_regular_file(target, fault))
      return std::nullopt;
  }
  return file;
}

LoadedMesh loaded(scene::MeshReading reading) {
  return {std::move(reading.mesh), std::move(reading.warnings)};
}

/// Readers name files and lines in their messages; the field is where the client gave the mesh.
template <class Load>
auto load_at(const std::string& field, const Load& load) {
  try {
    return load();
  } catch (const Error& error) {
    throw Error(error.code(), field, error.what());
  }
}

}  // namespace

LoadedMesh load_mesh_file(const fs::path& file, const std::string& field,
                          const scene::MeshReadLimits& limits) {
  return load_at(field,
                 [&] { return loaded(scene::read_mesh_file(file, std::size_t{1} << 30, limits)); });
}

std::string read_file_at(const fs::path& file, const std::string& field) {
  return load_at(field, [&] { return scene::read_bytes(file); });
}

fs::path MeshSources::resolve(const std::string& path, const std::string& field) const {
  for (const auto& root : roots_) {
    if (path.find('\0') != std::string::npos) break;
    if (auto file = below(root, path)) return *file;
  }
  throw Refusal(proto::ERROR_CODE_NOT_FOUND, field,
                roots_.empty()
                    ? "this server has no mesh folder (--mesh-root); send the file instead"
                    : fmt::format("'{}' is no file below this server's mesh folders",
                                  abbreviate(path, 1000)));
}

LoadedMesh MeshSources::load(const proto::MeshSource& source, const std::string& field) const {
  switch (source.source_case()) {
    case proto::MeshSource::kPath:
      return load_mesh_file(resolve(source.path(), field + ".path"), field + ".path", limits_);
    case proto::MeshSource::kFile:
      return load_at(field + ".file",
                     [&] { return loaded(scene::read_mesh(file_set(source.file()), limits_)); });
    case proto::MeshSource::kSample:
      return load_at(field + ".sample", [&] {
        return LoadedMesh{scene::make_sample(source.sample()).mesh, {}};
      });
    default:
      break;
  }
  throw invalid(field, "a scene needs a mesh: path, file, arrays or sample");
}

scene::MeshFileSet file_set(const proto::MeshFile& file) {
  scene::MeshFileSet files{file.name(), file.content(), {}};
  for (const auto& [name, bytes] : file.companions()) files.companions[name] = bytes;
  return files;
}

}  // namespace limber::server
