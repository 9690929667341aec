#include "clients/cpp/linkages/plain_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "clients/cpp/error.h"
#include "clients/cpp/files.h"
#include "clients/cpp/material_words.h"
#include "clients/cpp/obj_lines.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;

constexpr double kWidth = 0.1, kHeight = 0.05;  // of a lath, as shares of the median line

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

v1::Scene scene_of_lines(const fs::path& path) {
  const double line = median_length(read_obj_lines(read_bytes(path, "scene")));
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

std::string linkage_assumptions(const v1::Scene& scene) {
  const auto& lath = scene.linkage().section().rectangle();
  return fmt::format(
      "a rod linkage of laths {:.3g} wide and {:.3g} high (a tenth and a twentieth of the median "
      "line); {}",
      lath.width(), lath.height(),
      material_words(scene.linkage().material(), scene.length_unit_in_metres()));
}

}  // namespace limber::client
