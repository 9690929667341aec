// MSH 2.x: one list of nodes, one of elements; in binary files elements of equal type follow a
// common header.
#include "engine/scene/formats/gmsh.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {
namespace {

class Gmsh2Reader {
 public:
  Gmsh2Reader(TextCursor& file, const GmshHeader& header)
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
        const std::int64_t count = file_.count("the number of elements", number_.binary() ? 8 : 4);
        file_.skip_line();
        number_.binary() ? read_binary_elements(count) : read_text_elements(count);
        elements = true;
      } else if (section == "PhysicalNames") {
        read_gmsh_names(file_, builder_);
      } else {
        continue;  // lines up to the next '$' are passed over
      }
      if (next_gmsh_section(file_) != "End" + section) file_.fail("expected '$End" + section + "'");
      if (nodes && elements) break;
    }
    if (!nodes) file_.fail("the file has no $Nodes");
    if (!elements) file_.fail("the file has no $Elements");
    return builder_.finish();
  }

 private:
  void read_nodes() {
    const std::int64_t count = file_.count("the number of nodes", number_.binary() ? 28 : 8);
    file_.skip_line();
    builder_.reserve_nodes(count);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t label = number_.int32("a node id");
      const double x = number_.real("coordinate x");
      const double y = number_.real("coordinate y");
      const double z = number_.real("coordinate z");
      builder_.add_node(label, x, y, z);
    }
  }

  void read_text_elements(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t label = file_.integer("an element id");
      const std::int64_t type = file_.integer_in_line("an element type");
      const std::int64_t tags = file_.integer_in_line("a number of tags");
      std::int64_t group = 0;
      for (std::int64_t tag = 0; tag < tags; ++tag) {
        const std::int64_t value = file_.integer_in_line("a tag");
        if (tag == 0) group = value;
      }
      const GmshElementType* const info = gmsh_element_type(type);
      add_element(info, type, label, group, [&] { return file_.integer_in_line("a node id"); });
      file_.skip_line();
    }
  }

  void read_binary_elements(std::int64_t count) {
    for (std::int64_t read = 0; read < count;) {
      const std::int64_t type = number_.int32("an element type");
      const std::int64_t block = number_.int32("a number of elements");
      const std::int64_t tags = number_.int32("a number of tags");
      const GmshElementType* const info = gmsh_element_type(type);
      if (block <= 0 || block > count - read)
        file_.fail("a block of elements has a wrong count: " + std::to_string(block));
      file_.check_count(tags, "the number of tags", 4);
      for (std::int64_t i = 0; i < block; ++i) {
        const std::int64_t label = number_.int32("an element id");
        std::int64_t group = 0;
        for (std::int64_t tag = 0; tag < tags; ++tag) {
          const std::int64_t value = number_.int32("a tag");
          if (tag == 0) group = value;
        }
        add_element(info, type, label, group, [&] { return number_.int32("a node id"); });
      }
      read += block;
    }
  }

  /// @param group  the first tag, the physical entity; 0: none
  template <typename NextNode>
  void add_element(const GmshElementType* info, std::int64_t type, std::int64_t label,
                   std::int64_t group, const NextNode& next_node) {
    if (info == nullptr) {
      file_.fail_at(file_.line(), "element type " + std::to_string(type) + " is not known",
                    ErrorCode::kUnsupported);
    }
    const std::int64_t line = file_.line();
    std::array<std::int64_t, 4> corners{};
    for (int node = 0; node < info->nodes; ++node) {
      const std::int64_t value = next_node();
      if (node < 4) corners[static_cast<std::size_t>(node)] = value;
    }
    if (!info->tet) {
      builder_.ignore_cell(info->name);
      return;
    }
    builder_.add_tet(label, corners, line, group == 0 ? MeshBuilder::kNoGroup : group);
    if (info->nodes > 4) builder_.count_curved_tet();
  }

  TextCursor& file_;
  GmshNumbers number_;
  MeshBuilder builder_;
};

}  // namespace

MeshReading read_gmsh_2(TextCursor& file, const GmshHeader& header) {
  return Gmsh2Reader(file, header).read();
}

MeshReading read_gmsh_1(TextCursor& file) {
  MeshBuilder builder(file);
  file.expect("$NOD");
  const std::int64_t node_count = file.count("the number of nodes", 8);
  builder.reserve_nodes(node_count);
  for (std::int64_t i = 0; i < node_count; ++i) {
    const std::int64_t label = file.integer("a node id");
    const double x = file.real_in_line("coordinate x");
    const double y = file.real_in_line("coordinate y");
    const double z = file.real_in_line("coordinate z");
    builder.add_node(label, x, y, z);
  }
  file.expect("$ENDNOD");
  file.expect("$ELM");
  const std::int64_t element_count = file.count("the number of elements", 10);
  for (std::int64_t i = 0; i < element_count; ++i) {
    // id, type, physical entity, elementary entity, number of nodes, nodes
    const std::int64_t label = file.integer("an element id");
    const std::int64_t line = file.line();
    const std::int64_t type = file.integer_in_line("an element type");
    const std::int64_t group = file.integer_in_line("a physical entity");
    file.integer_in_line("an elementary entity");
    const std::int64_t nodes = file.integer_in_line("a number of nodes");
    const GmshElementType* const info = gmsh_element_type(type);
    if (info != nullptr && info->tet) {
      if (nodes != info->nodes) file.fail("a tetrahedron with " + std::to_string(nodes) + " nodes");
      std::array<std::int64_t, 4> corners{};
      for (std::int64_t& corner : corners) corner = file.integer_in_line("a node id");
      builder.add_tet(label, corners, line, group == 0 ? MeshBuilder::kNoGroup : group);
      if (nodes > 4) builder.count_curved_tet();
    } else {
      builder.ignore_cell(info != nullptr ? info->name : "cells of unknown type");
    }
    file.skip_line();
  }
  file.expect("$ENDELM");
  return builder.finish();
}

}  // namespace limber::scene::formats
