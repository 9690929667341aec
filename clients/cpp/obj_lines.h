#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace limber::client {

/// Lines of an .obj (`l`).
struct ObjLines {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::pair<long, long>> lines;  // vertices from 0, not checked
  bool has_faces = false;
};

[[nodiscard]] ObjLines read_obj_lines(const std::string& content);

}  // namespace limber::client
