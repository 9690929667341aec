// Medit .mesh (INRIA, ASCII): keywords, each followed by a count and that many entries; every entry
// ends in a reference number. Vertices are counted from 1.
#include "engine/scene/formats/mesh_builder.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {
namespace {

bool starts_keyword(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

void skip_numbers(TextCursor& file) {
  while (file.skip_blanks() && !starts_keyword(file.peek())) file.word();
}

const char* cell_of_keyword(std::string_view keyword) {
  static constexpr std::pair<const char*, const char*> kCells[] = {
      {"Edges", "lines"},       {"Triangles", "triangles"}, {"Quadrilaterals", "quadrangles"},
      {"Quads", "quadrangles"}, {"Hexahedra", "hexahedra"}, {"Hexaedra", "hexahedra"},
      {"Prisms", "prisms"},     {"Pyramids", "pyramids"},
  };
  for (const auto& [word, cell] : kCells) {
    if (same_word(keyword, word)) return cell;
  }
  return nullptr;
}

}  // namespace

MeshReading read_medit(TextCursor& file) {
  file.set_comment('#');
  MeshBuilder builder(file);
  while (file.skip_blanks()) {
    const std::int64_t line = file.line();
    const std::string keyword(file.word());
    if (!starts_keyword(keyword[0]))
      file.fail_at(line, "expected a keyword, found " + in_quotes(keyword));
    if (same_word(keyword, "End")) break;
    if (same_word(keyword, "MeshVersionFormatted")) {
      const std::int64_t version = file.integer("a version");
      if (version < 0 || version > 4) {
        file.fail_at(line, "Medit version " + std::to_string(version) + " is not known",
                     ErrorCode::kUnsupported);
      }
    } else if (same_word(keyword, "Dimension")) {
      if (const std::int64_t dimension = file.integer("a dimension"); dimension != 3) {
        file.fail("the dimension is " + std::to_string(dimension) + ", not 3");
      }
    } else if (same_word(keyword, "Vertices")) {
      const std::int64_t count = file.count("the number of vertices", 8);
      builder.reserve_nodes(count);
      for (std::int64_t i = 0; i < count; ++i) {
        const double x = file.real("coordinate x");
        const double y = file.real_in_line("coordinate y");
        const double z = file.real_in_line("coordinate z");
        file.real_in_line("a reference number");
        builder.add_node(i + 1, x, y, z);
      }
    } else if (same_word(keyword, "Tetrahedra")) {
      const std::int64_t count = file.count("the number of tetrahedra", 8);
      builder.reserve_tets(count);
      for (std::int64_t i = 0; i < count; ++i) {
        std::array<std::int64_t, 4> nodes{};
        nodes[0] = file.integer("a vertex");
        for (int corner = 1; corner < 4; ++corner) {
          nodes[static_cast<std::size_t>(corner)] = file.integer_in_line("a vertex");
        }
        const std::int64_t tet_line = file.line();
        const std::int64_t reference = file.integer_in_line("a reference number");
        builder.add_tet(i + 1, nodes, tet_line, reference);
      }
    } else {
      if (const char* const cell = cell_of_keyword(keyword)) {
        builder.ignore_cell(cell, file.count("a number of cells", 2));
      }
      skip_numbers(file);
    }
  }
  return builder.finish();
}

}  // namespace limber::scene::formats
