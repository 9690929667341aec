// MSH 4.1: nodes and elements come in blocks, one per entity of the model.
#include <cstdlib>
#include <map>

#include "engine/scene/formats/gmsh.h"

namespace limber::scene::formats {
namespace {

class Gmsh4Reader {
 public:
  Gmsh4Reader(TextCursor& file, const GmshHeader& header)
      : file_(file), number_(file, header), builder_(file) {}

  MeshReading read() {
    bool nodes = false;
    bool elements = false;
    for (std::string section = next_gmsh_section(file_); !section.empty();
         section = next_gmsh_section(file_)) {
      if (section == "Nodes") {
        read_nodes();
        nodes = true;
      } else if (section == "Elements") {
        read_elements();
        elements = true;
      } else if (section == "PhysicalNames") {
        read_gmsh_names(file_, builder_);
      } else if (section == "Entities") {
        read_entities();
      } else {
        skip_section(section);
        continue;
      }
      if (next_gmsh_section(file_) != "End" + section) file_.fail("expected '$End" + section + "'");
      if (nodes && elements) break;  // nothing behind these is read
    }
    if (!nodes) file_.fail("the file has no $Nodes");
    if (!elements) file_.fail("the file has no $Elements");
    return builder_.finish();
  }

 private:
  void skip_section(const std::string& section) {
    // Binary sections may hold any bytes, so the end is looked for as "$EndName" at the start of
    // any line.
    const std::int64_t line = file_.line();
    for (std::string name = next_gmsh_section(file_); name != "End" + section;
         name = next_gmsh_section(file_)) {
      if (name.empty()) file_.fail_at(line, "section $" + section + " does not end");
    }
  }

  void read_nodes() {
    const std::int64_t blocks = number_.int64("the number of node blocks");
    const std::int64_t total = number_.int64("the number of nodes");
    number_.int64("the smallest node tag");
    number_.int64("the largest node tag");
    file_.check_count(blocks, "the number of node blocks", number_.binary() ? 20 : 8);
    file_.check_count(total, "the number of nodes", number_.binary() ? 32 : 8);
    builder_.reserve_nodes(total);
    for (std::int64_t block = 0; block < blocks; ++block) read_node_block();
    if (static_cast<std::int64_t>(builder_.node_count()) != total) {
      file_.fail("the blocks hold " + std::to_string(builder_.node_count()) + " nodes, not " +
                 std::to_string(total));
    }
  }

  /// Points, curves, surfaces and volumes with their physical groups; those of volumes count.
  void read_entities() {
    std::array<std::int64_t, 4> counts{};
    for (std::int64_t& count : counts) {
      count = number_.int64("a number of entities");
      file_.check_count(count, "a number of entities", number_.binary() ? 32 : 8);
    }
    for (std::size_t dimension = 0; dimension < counts.size(); ++dimension)
      for (std::int64_t i = 0; i < counts[dimension]; ++i) read_entity(dimension);
  }

  void read_entity(std::size_t dimension) {
    const std::int64_t tag = number_.int32("the tag of an entity");
    for (int i = 0; i < (dimension == 0 ? 3 : 6); ++i) number_.real("a corner of an entity");
    const std::int64_t groups = number_.int64("a number of physical groups");
    file_.check_count(groups, "a number of physical groups", number_.binary() ? 4 : 1);
    for (std::int64_t i = 0; i < groups; ++i) {
      const std::int64_t group = number_.int32("a physical group");
      if (dimension == 3 && i == 0) group_of_volume_[tag] = group;
      if (dimension == 3 && i == 1)
        builder_.warn("a volume is in several physical groups: its first one is taken");
    }
    if (dimension == 0) return;
    const std::int64_t bounds = number_.int64("a number of bounding entities");
    file_.check_count(bounds, "a number of bounding entities", number_.binary() ? 4 : 1);
    for (std::int64_t i = 0; i < bounds; ++i) number_.int32("a bounding entity");
  }

  void read_node_block() {
    const std::int64_t dimension = number_.int32("the dimension of an entity");
    number_.int32("the tag of an entity");
    const std::int64_t parametric = number_.int32("the parametric flag");
    const std::int64_t count = number_.int64("the number of nodes in a block");
    if (dimension < 0 || dimension > 3)
      file_.fail("the dimension of an entity is not 0, 1, 2 or 3");
    file_.check_count(count, "the number of nodes in a block", number_.binary() ? 32 : 8);
    std::vector<std::int64_t> labels(static_cast<std::size_t>(count));
    for (std::int64_t& label : labels) label = number_.int64("a node tag");
    const std::int64_t parameters = parametric != 0 ? dimension : 0;
    for (const std::int64_t label : labels) {
      const double x = number_.real("coordinate x");
      const double y = number_.real("coordinate y");
      const double z = number_.real("coordinate z");
      builder_.add_node(label, x, y, z);
      for (std::int64_t i = 0; i < parameters; ++i) number_.real("a parametric coordinate");
    }
  }

  void read_elements() {
    const std::int64_t blocks = number_.int64("the number of element blocks");
    const std::int64_t total = number_.int64("the number of elements");
    number_.int64("the smallest element tag");
    number_.int64("the largest element tag");
    file_.check_count(blocks, "the number of element blocks", number_.binary() ? 20 : 8);
    file_.check_count(total, "the number of elements", number_.binary() ? 16 : 4);
    std::int64_t found = 0;
    for (std::int64_t block = 0; block < blocks; ++block) found += read_element_block();
    if (found != total) {
      file_.fail("the blocks hold " + std::to_string(found) + " elements, not " +
                 std::to_string(total));
    }
  }

  std::int64_t read_element_block() {
    number_.int32("the dimension of an entity");
    const auto volume = group_of_volume_.find(number_.int32("the tag of an entity"));
    const std::int64_t type = number_.int32("an element type");
    const std::int64_t count = number_.int64("the number of elements in a block");
    const GmshElementType* const info = gmsh_element_type(type);
    if (info == nullptr) {
      file_.fail_at(file_.line(), "element type " + std::to_string(type) + " is not known",
                    ErrorCode::kUnsupported);
    }
    file_.check_count(count, "the number of elements in a block", number_.binary() ? 16 : 4);
    if (!info->tet) builder_.ignore_cell(info->name, count);
    const std::int64_t group =
        volume == group_of_volume_.end() ? MeshBuilder::kNoGroup : std::abs(volume->second);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t label = number_.int64("an element tag");
      const std::int64_t line = file_.line();
      std::array<std::int64_t, 4> corners{};
      for (int node = 0; node < info->nodes; ++node) {
        const std::int64_t value = number_.int64("a node tag");
        if (node < 4) corners[static_cast<std::size_t>(node)] = value;
      }
      if (!info->tet) continue;
      builder_.add_tet(label, corners, line, group);
      if (info->nodes > 4) builder_.count_curved_tet();
    }
    return count;
  }

  TextCursor& file_;
  GmshNumbers number_;
  MeshBuilder builder_;
  std::map<std::int64_t, std::int64_t> group_of_volume_;
};

}  // namespace

MeshReading read_gmsh_4(TextCursor& file, const GmshHeader& header) {
  return Gmsh4Reader(file, header).read();
}

}  // namespace limber::scene::formats
