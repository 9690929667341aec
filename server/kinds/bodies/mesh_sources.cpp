#include "server/kinds/bodies/mesh_sources.h"
#include "server/wire/fields.h"

#include <utility>

#include "engine/scene/samples/samples.h"

namespace limber::server {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

LoadedMesh loaded(scene::MeshReading reading) {
  return {std::move(reading.mesh), std::move(reading.warnings), std::move(reading.groups)};
}

LoadedMesh load_mesh(const proto::MeshSource& source, const std::string& field,
                     const PathResolver& resolve, const scene::MeshReadLimits& limits) {
  switch (source.source_case()) {
    case proto::MeshSource::kPath: {
      const std::filesystem::path file = resolve(source.path(), field + ".path");
      return read_at(field + ".path",
                     [&] { return loaded(scene::read_mesh_file(file, kMaxFileBytes, limits)); });
    }
    case proto::MeshSource::kFile:
      return read_at(field + ".file",
                     [&] { return loaded(scene::read_mesh(file_set(source.file()), limits)); });
    case proto::MeshSource::kSample:
      return read_at(field + ".sample", [&] {
        return LoadedMesh{scene::make_sample(source.sample()).mesh, {}, {}};
      });
    default:
      break;
  }
  throw invalid(field, "a scene needs a mesh: path, file, arrays or sample");
}

}  // namespace

MeshLoader mesh_loader(PathResolver resolve, scene::MeshReadLimits limits) {
  return [resolve = std::move(resolve), limits](const proto::MeshSource& source,
                                                const std::string& field) {
    return load_mesh(source, field, resolve, limits);
  };
}

std::string read_file_at(const std::filesystem::path& file, const std::string& field) {
  return read_at(field, [&] { return scene::read_bytes(file); });
}

scene::MeshFileSet file_set(const proto::MeshFile& file) {
  scene::MeshFileSet files{file.name(), file.content(), {}};
  for (const auto& [name, bytes] : file.companions()) files.companions[name] = bytes;
  return files;
}

}  // namespace limber::server
