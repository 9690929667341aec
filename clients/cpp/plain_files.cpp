#include "clients/cpp/plain_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <sstream>
#include <vector>

#include "clients/cpp/error.h"
#include "clients/cpp/scene_files.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

constexpr double kWidth = 0.1, kHeight = 0.05;  // of a lath, as shares of the median line

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_one_of(const std::string& ending, std::initializer_list<const char*> endings) {
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

struct ObjLines {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::pair<long, long>> lines;  // vertices from 0
  bool has_faces = false;
};

ObjLines read_obj(const std::string& content) {
  ObjLines obj;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "f") obj.has_faces = true;
    if (word == "v") {
      std::array<double, 3> point{};
      words >> point[0] >> point[1] >> point[2];
      obj.vertices.push_back(point);
    }
    if (word != "l") continue;
    long last = 0;
    for (std::string vertex; words >> vertex;) {
      long number = std::strtol(vertex.c_str(), nullptr, 10);
      if (number < 0) number += static_cast<long>(obj.vertices.size()) + 1;
      if (last != 0) obj.lines.emplace_back(last - 1, number - 1);
      last = number;
    }
  }
  return obj;
}

double median_length(const ObjLines& obj) {
  std::vector<double> lengths;
  const auto count = static_cast<long>(obj.vertices.size());
  for (const auto& [a, b] : obj.lines) {
    if (std::min(a, b) < 0 || std::max(a, b) >= count) continue;  // the server says so
    const auto& p = obj.vertices[static_cast<std::size_t>(a)];
    const auto& q = obj.vertices[static_cast<std::size_t>(b)];
    lengths.push_back(std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
  }
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

}  // namespace

FileKind kind_of_file(const fs::path& path) {
  const std::string ending = ending_of(path);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return FileKind::kScene;
  if (is_one_of(ending, {".msh", ".mesh", ".vtk", ".vtu", ".ele", ".node", ".veg", ".abq", ".inp"}))
    return FileKind::kTets;
  if (is_one_of(ending, {".ply", ".stl"})) return FileKind::kTriangles;
  if (ending != ".obj") return FileKind::kScene;
  const ObjLines obj = read_obj(read_bytes(path, "scene"));
  return obj.has_faces || obj.lines.empty() ? FileKind::kTriangles : FileKind::kLines;
}

v1::Scene scene_of_tets(const fs::path& path) {
  v1::Scene scene;
  scene.set_name(path.stem().string());
  scene.set_frames(kFramesOfPlainFiles);
  *scene.mutable_mesh()->mutable_file() = mesh_file(path);
  return scene;
}

v1::Scene scene_of_lines(const fs::path& path) {
  const double line = median_length(read_obj(read_bytes(path, "scene")));
  if (!(line > 0) || !std::isfinite(line))
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "scene",
                      path.string() + " has no lines (`l`) of some length");
  v1::Scene scene;
  scene.set_name(path.stem().string());
  auto& linkage = *scene.mutable_linkage();
  *linkage.mutable_lines()->mutable_file() = mesh_file(path, "linkage.lines.path");
  linkage.mutable_section()->mutable_rectangle()->set_width(kWidth * line);
  linkage.mutable_section()->mutable_rectangle()->set_height(kHeight * line);
  return scene;
}

std::string assumed(const v1::Scene& scene) {
  const v1::Material& material =
      scene.has_linkage() ? scene.linkage().material() : scene.material();
  std::string words = fmt::format(
      "Young's modulus {:.3g} Pa, Poisson's ratio {:.3g}, {:.4g} kg/m3, 1 unit = {:.4g} m",
      material.youngs_modulus(), material.poissons_ratio(), material.density(),
      scene.length_unit_in_metres());
  if (scene.has_linkage()) {
    const auto& lath = scene.linkage().section().rectangle();
    return fmt::format(
        "a rod linkage of laths {:.3g} wide and {:.3g} high (a tenth and a twentieth of the median "
        "line); {}",
        lath.width(), lath.height(), words);
  }
  return fmt::format("an elastic body of which nothing is fixed, {} frames at {:.4g} a second; {}",
                     scene.frames(), scene.dynamics().frames_per_second(), words);
}

}  // namespace limber::client
