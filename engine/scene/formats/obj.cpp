// Wavefront .obj: "v x y z" and "f i j k ...", indices from 1 or negative from the end; all else is
// passed over.
#include "engine/scene/formats/obj_elements.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
TriangleSurface read_obj(TextCursor& file) {
  file.set_comment('#');
  SurfaceBuilder builder;
  std::vector<std::int64_t> corners;
  while (file.skip_blanks()) {
    const std::int64_t line = file.line();
    const std::string_view keyword = file.word();
    if (keyword == "v") {
      const Eigen::Vector3d vertex = obj_vertex(file);
      builder.add_vertex(vertex.x(), vertex.y(), vertex.z());
    } else if (keyword == "f") {
      corners.clear();
      while (file.skip_blanks_in_line()) {
        corners.push_back(obj_vertex_index(file.word(), builder.vertex_count(), file, line));
      }
      if (!builder.add_polygon(corners, line))
        file.fail_at(line, "a face of fewer than three vertices");
    } else {
      file.skip_line();
    }
  }
  return builder.finish(file);
}

}  // namespace limber::scene::formats
