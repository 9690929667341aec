#include "clients/cpp/bodies/surface_files.h"

#include <sstream>
#include <system_error>
#include <vector>

#include "clients/cpp/files.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

/// Material files that the lines "mtllib NAME" of an .obj name.
std::vector<std::string> material_libraries(const std::string& obj) {
  constexpr const char* kKeyword = "mtllib";
  std::vector<std::string> names;
  std::istringstream lines(obj);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(kKeyword)) continue;
    const auto begin = line.find_first_not_of(" \t", std::string(kKeyword).size());
    if (begin == std::string::npos) continue;
    const auto end = line.find_last_not_of(" \t\r");
    names.push_back(line.substr(begin, end + 1 - begin));
  }
  return names;
}

}  // namespace

v1::MeshFile surface_file(const fs::path& path, const std::string& field) {
  v1::MeshFile file;
  file.set_name(path.filename().string());
  file.set_content(read_bytes(path, field));
  if (lower_ending(path) != ".obj") return file;
  for (const std::string& name : material_libraries(file.content())) {
    std::error_code ignored;
    const fs::path beside = path.parent_path() / fs::path(name).filename();
    if (lower_ending(beside) == ".mtl" && fs::is_regular_file(beside, ignored))
      (*file.mutable_companions())[beside.filename().string()] = read_bytes(beside, field);
  }
  return file;
}

std::optional<fs::path> surface_beside(const fs::path& mesh) {
  for (const char* ending :
       {".surface.obj", ".surface.ply", ".surface.stl", ".surface.off", ".surface.glb"}) {
    const fs::path beside = fs::path(mesh).replace_extension(ending);
    std::error_code ignored;
    if (fs::is_regular_file(beside, ignored)) return beside;
  }
  return std::nullopt;
}

void put_surface_bytes(v1::Scene& scene, const fs::path& folder) {
  if (!scene.surface().has_path()) return;
  *scene.mutable_surface()->mutable_file() =
      surface_file(folder / scene.surface().path(), "surface.path");
}

void save_surface(v1::Scene& scene, const fs::path& folder) {
  if (!scene.surface().has_file()) return;
  const v1::MeshFile file = scene.surface().file();
  for (const auto& [companion, content] : file.companions())
    write_bytes(folder / fs::path(companion).filename(), content);
  const std::string name = fs::path(file.name()).filename().string();
  write_bytes(folder / name, file.content());
  scene.mutable_surface()->set_path(name);
}

}  // namespace limber::client
