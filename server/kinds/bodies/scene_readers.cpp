#include "server/kinds/bodies/scene_readers.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "engine/scene/formats/surface_formats.h"
#include "server/kinds/bodies/base_motions.h"
#include "server/kinds/bodies/mesh_sources.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

/// @throws Refusal of a name that no export may write
std::string material_name(const std::string& name, const std::string& field) {
  const std::filesystem::path path(name);
  if (path.has_parent_path() || scene::surface_ending(name) != ".mtl" || path.stem().empty())
    throw invalid(field, fmt::format("'{}' is no name of a material file (.mtl)", name));
  return name;
}

/// The material files in the folder of an .obj of this machine, as far as they may be read.
void add_materials(const std::string& path, const std::string& field, const PathResolver& resolve,
                   scene::DetailedSurface& surface) {
  if (scene::surface_ending(surface.name) != ".obj") return;
  for (const std::string& name : scene::material_libraries(surface.content)) {
    try {
      const auto beside = std::filesystem::path(path).parent_path() / name;
      surface.companions[name] = read_file_at(resolve(beside.string(), field), field);
    } catch (const Error&) {  // a surface without its colours is a surface
      continue;
    } catch (const Refusal&) {
      continue;
    }
  }
}

scene::DetailedSurface read_detailed(std::string name, std::string content) {
  scene::DetailedSurface surface{std::move(name), std::move(content), {}, {}};
  surface.surface = scene::read_surface(surface.name, surface.content);
  return surface;
}

}  // namespace

SurfaceReader surface_reader(PathResolver resolve) {
  return
      [resolve = std::move(resolve)](const proto::SurfaceSource& source, const std::string& field) {
        switch (source.source_case()) {
          case proto::SurfaceSource::kPath: {
            const auto file = resolve(source.path(), field + ".path");
            std::string content = read_file_at(file, field + ".path");
            auto surface = read_at(field + ".path", [&] {
              return read_detailed(file.filename().string(), std::move(content));
            });
            add_materials(source.path(), field + ".path", resolve, surface);
            return surface;
          }
          case proto::SurfaceSource::kFile: {
            auto surface = read_at(field + ".file", [&] {
              return read_detailed(source.file().name(), source.file().content());
            });
            for (const auto& [name, bytes] : source.file().companions())
              surface.companions[material_name(name, field + ".file.companions")] = bytes;
            return surface;
          }
          case proto::SurfaceSource::SOURCE_NOT_SET:
            break;
        }
        throw invalid(field,
                      fmt::format("a surface needs a file or a path: {}", scene::kSurfaceEndings));
      };
}

SceneReaders scene_readers(const PathResolver& resolve, scene::MeshReadLimits limits) {
  SceneReaders readers{mesh_loader(resolve, limits), base_motion_reader(resolve),
                       surface_reader(resolve)};
  readers.stiffness = [resolve](const std::string& path, const std::string& field) {
    return read_file_at(resolve(path, field), field);
  };
  return readers;
}

}  // namespace limber::server
