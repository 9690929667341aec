#include "server/kinds/bodies/scene_readers.h"

#include <filesystem>
#include <utility>

#include "engine/scene/formats/surface_formats.h"
#include "server/kinds/bodies/base_motions.h"
#include "server/kinds/bodies/mesh_sources.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

scene::DetailedSurface read_detailed(std::string name, std::string content) {
  scene::DetailedSurface surface{std::move(name), std::move(content), {}, {}};
  surface.surface = scene::read_surface(surface.name, surface.content);
  return surface;
}

}  // namespace

SurfaceReader surface_reader(PathResolver resolve) {
  return [resolve = std::move(resolve)](const proto::SurfaceSource& source,
                                        const std::string& field) {
    switch (source.source_case()) {
      case proto::SurfaceSource::kPath: {
        const auto file = resolve(source.path(), field + ".path");
        std::string content = read_file_at(file, field + ".path");
        return read_at(field + ".path",
                       [&] { return read_detailed(file.filename().string(), std::move(content)); });
      }
      case proto::SurfaceSource::kFile: {
        auto surface = read_at(field + ".file", [&] {
          return read_detailed(source.file().name(), source.file().content());
        });
        for (const auto& [name, bytes] : source.file().companions())
          surface.companions[std::filesystem::path(name).filename().string()] = bytes;
        return surface;
      }
      case proto::SurfaceSource::SOURCE_NOT_SET:
        break;
    }
    throw invalid(field, "a surface needs a file or a path: .obj, .ply or .stl");
  };
}

SceneReaders scene_readers(const PathResolver& resolve, scene::MeshReadLimits limits) {
  return {mesh_loader(resolve, limits), base_motion_reader(resolve), surface_reader(resolve)};
}

}  // namespace limber::server
