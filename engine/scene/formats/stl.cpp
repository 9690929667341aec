// STL: triangles that repeat their corners. Binary files have an 80-byte header, a count and 50
// bytes per triangle; some of them begin with "solid" too, so the size decides.
#include <cmath>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
namespace {

constexpr std::size_t kStlHeaderBytes = 84;
constexpr std::size_t kTriangle = 50;

TriangleSurface read_binary(const TextCursor& file, std::string_view content) {
  SurfaceBuilder builder;
  CornerMerger merger(builder);
  const std::uint32_t count = decode<std::uint32_t>(content.data() + 80, ByteOrder::kLittle);
  for (std::uint32_t t = 0; t < count; ++t) {
    std::vector<std::int64_t> corners;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      double at[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[axis] = static_cast<double>(decode<float>(
            content.data() + kStlHeaderBytes + t * kTriangle + 12 + 12 * corner + 4 * axis,
            ByteOrder::kLittle));
        if (!std::isfinite(at[axis]))
          file.fail("a coordinate of triangle " + std::to_string(t) + " is not finite");
      }
      corners.push_back(merger.index(at[0], at[1], at[2]));
    }
    builder.add_polygon(corners, 1);
  }
  return builder.finish(file);
}

TriangleSurface read_text(TextCursor& file) {
  SurfaceBuilder builder;
  CornerMerger merger(builder);
  file.expect("solid");
  file.skip_line();
  std::vector<std::int64_t> corners;
  while (file.skip_blanks()) {
    const std::int64_t line = file.line();
    const std::string keyword = to_lower(file.word());
    if (keyword == "vertex") {
      const double x = file.real_in_line("coordinate x");
      const double y = file.real_in_line("coordinate y");
      const double z = file.real_in_line("coordinate z");
      corners.push_back(merger.index(x, y, z));
    } else if (keyword == "endloop") {
      if (corners.size() != 3)
        file.fail_at(line, "a facet of " + std::to_string(corners.size()) + " vertices");
      builder.add_polygon(corners, line);
      corners.clear();
    } else if (keyword == "facet" || keyword == "endsolid" || keyword == "solid") {
      file.skip_line();
    } else if (keyword != "outer" && keyword != "loop" && keyword != "endfacet") {
      file.fail_at(line, "the keyword " + in_quotes(keyword) + " is not known");
    }
  }
  if (!corners.empty()) file.fail("the file ends inside a facet");
  return builder.finish(file);
}

}  // namespace

TriangleSurface read_stl(TextCursor& file, std::string_view content) {
  if (content.size() >= kStlHeaderBytes) {
    const std::uint64_t count = decode<std::uint32_t>(content.data() + 80, ByteOrder::kLittle);
    if (content.size() == kStlHeaderBytes + count * kTriangle) return read_binary(file, content);
  }
  if (trim(content.substr(0, 80)).substr(0, 5) != "solid") {
    file.fail(
        "neither a text STL file (which begins with 'solid') nor a binary one of the size its "
        "count says");
  }
  return read_text(file);
}

}  // namespace limber::scene::formats
