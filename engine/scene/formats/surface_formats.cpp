#include "engine/scene/formats/surface_formats.h"

#include <charconv>

#include "engine/base/checked_number.h"
#include "engine/base/error.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene {
namespace formats {

bool SurfaceBuilder::add_polygon(const std::vector<std::int64_t>& corners, std::int64_t line) {
  if (corners.size() < 3) return false;
  if (corners.size() > 3) ++polygons_;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles_.push_back({{corners[0], corners[i - 1], corners[i]}, line});
  }
  return true;
}

TriangleSurface SurfaceBuilder::finish(const TextCursor& file) {
  if (triangles_.empty()) file.fail("the file has no triangles");
  TriangleSurface surface;
  surface.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    surface.vertices.col(static_cast<Eigen::Index>(i)) = vertices_[i];
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::int64_t given = triangles_[t].corners[corner];
      const auto index = to_whole<int>(given);
      if (!index || *index < 0 || *index >= vertex_count()) {
        file.fail_at(triangles_[t].line, "a face uses vertex " + std::to_string(given) +
                                             " (from 0) of " + std::to_string(vertex_count()));
      }
      surface.triangles(corner, static_cast<Eigen::Index>(t)) = *index;
    }
  }
  if (polygons_ > 0)
    surface.warnings.push_back(std::to_string(polygons_) + " polygons are cut into triangles");
  return surface;
}

}  // namespace formats

std::string surface_ending(const std::string& name) {
  return formats::to_lower(std::filesystem::path(name).extension().string());
}

std::vector<std::string> material_libraries(std::string_view obj) {
  constexpr std::string_view kKeyword = "mtllib";
  std::vector<std::string> names;
  while (!obj.empty()) {
    const std::string_view line = obj.substr(0, obj.find('\n'));
    obj.remove_prefix(std::min(obj.size(), line.size() + 1));
    if (!line.starts_with(kKeyword)) continue;
    const std::size_t begin = line.find_first_not_of(" \t", kKeyword.size());
    if (begin == std::string_view::npos || begin == kKeyword.size()) continue;
    const std::size_t end = line.find_last_not_of(" \t\r");
    std::string name =
        std::filesystem::path(line.substr(begin, end + 1 - begin)).filename().string();
    if (surface_ending(name) == ".mtl") names.push_back(std::move(name));
  }
  return names;
}

TriangleSurface read_surface(const std::string& name, std::string_view content) {
  const std::string ending = surface_ending(name);
  if (content.substr(0, 3) == "\xEF\xBB\xBF") content.remove_prefix(3);  // byte order mark
  formats::TextCursor file(name, content);
  if (ending == ".obj") return formats::read_obj(file);
  if (ending == ".ply" || content.substr(0, 4) == "ply\n" || content.substr(0, 5) == "ply\r\n")
    return formats::read_ply(file);
  if (ending == ".stl") return formats::read_stl(file, content);
  if (ending == ".off") return formats::read_off(file);
  if (ending == ".glb") return formats::read_glb(file, content);
  throw Error(ErrorCode::kUnsupported, name,
              name + ": the format is not recognised; read are " + kSurfaceEndings);
}

TriangleSurface read_surface_file(const std::filesystem::path& path) {
  return read_surface(path.filename().string(), read_bytes(path));
}

std::string write_obj(const Eigen::Matrix3Xd& vertices,
                      const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles) {
  std::string text = "# " + std::to_string(vertices.cols()) + " vertices, " +
                     std::to_string(triangles.cols()) + " triangles\n";
  char number[32];
  const auto append = [&](auto value) {
    text += ' ';
    text.append(number, std::to_chars(number, number + sizeof number, value).ptr);
  };
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    text += 'v';
    for (int axis = 0; axis < 3; ++axis) append(vertices(axis, i));
    text += '\n';
  }
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    text += 'f';
    for (int corner = 0; corner < 3; ++corner) append(triangles(corner, t) + 1);
    text += '\n';
  }
  return text;
}

}  // namespace limber::scene
