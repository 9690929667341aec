// TetGen .node and .ele: a header line of counts, then one line per node or tet that begins with
// its number. The first number, 0 or 1, decides how the file counts.
#include <algorithm>
#include <cmath>

#include "engine/scene/formats/mesh_builder.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {

MeshReading read_tetgen(TextCursor& nodes, TextCursor& elements) {
  nodes.set_comment('#');
  elements.set_comment('#');
  MeshBuilder builder(elements);
  const std::int64_t node_count = nodes.count("the number of nodes", 8);
  if (const std::int64_t dimension = nodes.integer_in_line("the dimension"); dimension != 3) {
    nodes.fail("the dimension is " + std::to_string(dimension) + ", not 3");
  }
  nodes.skip_line();
  builder.reserve_nodes(node_count);
  for (std::int64_t i = 0; i < node_count; ++i) {
    const std::int64_t label = nodes.integer("a node number");
    const double x = nodes.real_in_line("coordinate x");
    const double y = nodes.real_in_line("coordinate y");
    const double z = nodes.real_in_line("coordinate z");
    builder.add_node(label, x, y, z);
    nodes.skip_line();  // attributes and boundary marker
  }
  const std::int64_t tet_count = elements.count("the number of tetrahedra", 10);
  const std::int64_t corners = elements.integer_in_line("the number of nodes per tetrahedron");
  if (corners != 4 && corners != 10) {
    elements.fail("the number of nodes per tetrahedron is " + std::to_string(corners) +
                  ", not 4 or 10");
  }
  const bool has_regions =
      elements.skip_blanks_in_line() && elements.integer_in_line("the number of attributes") > 0;
  elements.skip_line();
  builder.reserve_tets(tet_count);
  for (std::int64_t i = 0; i < tet_count; ++i) {
    const std::int64_t label = elements.integer("a tetrahedron number");
    std::array<std::int64_t, 4> tet{};
    for (std::int64_t& node : tet) node = elements.integer_in_line("a node number");
    const std::int64_t line = elements.line();
    for (std::int64_t node = 4; node < corners && has_regions; ++node)
      elements.integer_in_line("a node number");
    std::int64_t region = MeshBuilder::kNoGroup;
    if (has_regions && elements.skip_blanks_in_line())
      region = std::llround(std::clamp(elements.real_in_line("a region"), -1e15, 1e15));
    builder.add_tet(label, tet, line, region);
    if (corners == 10) builder.count_curved_tet();
    elements.skip_line();
  }
  return builder.finish();
}

}  // namespace limber::scene::formats
