// Geomview .off: a keyword, counts of vertices, faces and edges, then a line for each vertex and
// face. Other data after coordinates and corners in a line (normals, colours) are ignored.
#include "engine/base/checked_number.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
namespace {

// Bytes that the shortest lines take: "0 0 0" and "1 0", each with an end.
constexpr std::size_t kVertexBytes = 6, kFaceBytes = 4;

/// Passes over the keyword; files without one begin with their counts.
void read_keyword(TextCursor& file) {
  if (!file.skip_blanks()) file.fail("the file is empty");
  if (file.peek() >= '0' && file.peek() <= '9') {
    TextCursor ahead = file;
    if (parse_number<std::int64_t>(ahead.word())) return;
  }
  const std::int64_t line = file.line();
  const std::string_view keyword = file.word();
  std::string_view prefix = keyword;
  if (!prefix.ends_with("OFF"))
    file.fail_at(line, "expected the keyword OFF, found " + in_quotes(keyword));
  prefix.remove_suffix(3);
  for (const std::string_view part : {"ST", "C", "N"})
    if (prefix.starts_with(part)) prefix.remove_prefix(part.size());
  if (!prefix.empty()) {
    file.fail_at(line, "vertices of " + in_quotes(keyword) + " have no three coordinates",
                 ErrorCode::kUnsupported);
  }
  TextCursor ahead = file;
  if (same_word(ahead.word(), "BINARY"))
    file.fail_at(line, "binary .off files are not read", ErrorCode::kUnsupported);
}

}  // namespace

TriangleSurface read_off(TextCursor& file) {
  file.set_comment('#');
  read_keyword(file);
  const std::int64_t vertices = file.integer("a number of vertices");
  const std::int64_t faces = file.integer("a number of faces");
  file.skip_line();  // the number of edges, which is not needed
  file.check_count(vertices, "the number of vertices", kVertexBytes);
  file.check_count(faces, "the number of faces", kFaceBytes);
  SurfaceBuilder builder;
  for (std::int64_t i = 0; i < vertices; ++i) {
    const double x = file.real("coordinate x");
    const double y = file.real_in_line("coordinate y");
    const double z = file.real_in_line("coordinate z");
    builder.add_vertex(x, y, z);
    file.skip_line();
  }
  std::int64_t slim = 0;
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < faces; ++i) {
    corners.clear();
    const std::int64_t size = file.count("the number of corners", 2);
    const std::int64_t line = file.line();
    for (std::int64_t corner = 0; corner < size; ++corner)
      corners.push_back(file.integer_in_line("a vertex index"));
    if (!builder.add_polygon(corners, line)) ++slim;
    file.skip_line();
  }
  TriangleSurface surface = builder.finish(file);
  if (slim > 0) {
    surface.warnings.push_back(std::to_string(slim) +
                               " faces of fewer than three corners are left out");
  }
  return surface;
}

}  // namespace limber::scene::formats
