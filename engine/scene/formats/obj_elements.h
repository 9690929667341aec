#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

/// The vertex index of "7", "7/1", "7//3" or "-1/2/3" in a Wavefront .obj, from 0; not yet checked
/// against the number of vertices.
inline std::int64_t obj_vertex_index(std::string_view corner, std::int64_t vertex_count,
                                     const TextCursor& file, std::int64_t line) {
  const auto index = parse_number<std::int64_t>(corner.substr(0, corner.find('/')));
  if (index == 0) {
    file.fail_at(
        line,
        "vertex index 0: OBJ files count vertices from 1 (negative: back from the newest); "
        "if this file counts from 0, add 1 to every index");
  }
  if (!index) file.fail_at(line, "expected a vertex index, found " + in_quotes(corner));
  return *index > 0 ? *index - 1 : vertex_count + *index;
}

/// The numbers after the "v" of a line: x y z; a weight or colours are ignored.
inline Eigen::Vector3d obj_vertex(TextCursor& file) {
  const double x = file.real_in_line("coordinate x");
  const double y = file.real_in_line("coordinate y");
  const double z = file.real_in_line("coordinate z");
  file.skip_line();
  return {x, y, z};
}

}  // namespace limber::scene::formats
