#include "clients/cpp/plain_files.h"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <system_error>

#include "clients/cpp/files.h"
#include "clients/cpp/obj_lines.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

bool is_one_of(const std::string& ending, std::initializer_list<const char*> endings) {
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

}  // namespace

FileKind kind_of_file(const fs::path& path) {
  const std::string ending = lower_ending(path);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return FileKind::kScene;
  if (is_one_of(ending, {".msh", ".mesh", ".vtk", ".vtu", ".ele", ".node", ".veg", ".abq", ".inp"}))
    return FileKind::kTets;
  if (is_one_of(ending, {".ply", ".stl", ".off", ".glb"})) return FileKind::kTriangles;
  if (ending != ".obj") return FileKind::kScene;
  const ObjLines obj = read_obj_lines(read_bytes(path, "scene"));
  return obj.has_faces || obj.lines.empty() ? FileKind::kTriangles : FileKind::kLines;
}

}  // namespace limber::client
