// Triangle surfaces in Stanford .ply files.
#include <cmath>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/ply_file.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
namespace {

class PlyReader {
 public:
  explicit PlyReader(TextCursor& file) : file_(file), ply_(file) {}

  TriangleSurface read() {
    for (const PlyElement& element : ply_.elements()) {
      ply_.check_count(element);
      for (std::int64_t i = 0; i < element.count; ++i) {
        if (element.name == "vertex") {
          read_vertex(element);
        } else if (element.name == "face") {
          read_face(element);
        } else {
          for (const PlyProperty& property : element.properties) ply_.read(property);
        }
      }
    }
    return builder_.finish(file_);
  }

 private:
  void read_vertex(const PlyElement& element) {
    double at[3] = {0, 0, 0};
    int found = 0;
    for (const PlyProperty& property : element.properties) {
      const std::vector<double>& values = ply_.read(property);
      for (int axis = 0; axis < 3; ++axis) {
        if (property.list || property.name != std::string(1, "xyz"[axis])) continue;
        at[axis] = values[0];
        ++found;
      }
    }
    if (found != 3) file_.fail("vertices need the properties x, y and z");
    if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2])) {
      file_.fail("a coordinate of vertex " + std::to_string(builder_.vertex_count()) +
                 " is not finite");
    }
    builder_.add_vertex(at[0], at[1], at[2]);
  }

  void read_face(const PlyElement& element) {
    for (const PlyProperty& property : element.properties) {
      const std::vector<double>& values = ply_.read(property);
      if (!property.list || (property.name != "vertex_indices" && property.name != "vertex_index"))
        continue;
      std::vector<std::int64_t> corners;
      for (const double value : values) {
        const auto corner = to_whole<std::int64_t>(value);
        if (!corner) file_.fail("a vertex index that is no whole number");
        corners.push_back(*corner);
      }
      if (!builder_.add_polygon(corners, file_.line()))
        file_.fail("a face of fewer than three vertices");
    }
  }

  TextCursor& file_;
  PlyFile ply_;
  SurfaceBuilder builder_;
};

}  // namespace

TriangleSurface read_ply(TextCursor& file) { return PlyReader(file).read(); }

}  // namespace limber::scene::formats
