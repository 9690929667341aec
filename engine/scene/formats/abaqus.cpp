// Abaqus input (.inp, .abq): keyword lines begin with one star, comments with two; data lines are
// separated by commas. Nodes, elements and their sets, solid sections and isotropic elastic
// materials are read; steps and all else are passed over.

#include "engine/scene/formats/abaqus_keyword.h"
#include "engine/scene/formats/abaqus_materials.h"
#include "engine/scene/formats/mesh_builder.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {
namespace {

class AbaqusReader {
 public:
  explicit AbaqusReader(TextCursor& file) : file_(file), builder_(file) {
    file_.set_comma_separates(true);
  }

  MeshReading read() {
    while (file_.skip_blanks()) {
      if (file_.peek() == '*') {
        read_keyword();
        continue;
      }
      switch (section_) {
        case Section::kNodes:
          read_node();
          break;
        case Section::kTets:
          read_tet();
          break;
        case Section::kOtherElements:
          skip_element();
          break;
        case Section::kMaterials:
          read_material_data();
          break;
        case Section::kOther:
          file_.skip_line();
          break;
      }
    }
    if (instances_ > 1) {
      builder_.warn("the file places " + std::to_string(instances_) +
                    " part instances; parts are read once each, in their own coordinates");
    }
    materials_.store(builder_, kPartStride);
    return builder_.finish();
  }

 private:
  enum class Section { kOther, kNodes, kTets, kOtherElements, kMaterials };
  static constexpr std::int64_t kPartStride = std::int64_t{1} << 40;

  void read_keyword() {
    const std::int64_t line_number = file_.line();
    std::string_view line;
    file_.next_line(line);
    if (line.substr(0, 2) == "**") return;  // a comment does not end a section
    const AbaqusKeyword keyword = parse_abaqus_keyword(line);
    section_ = Section::kOther;
    if (keyword.name == "node") {
      refuse_outside_data(keyword, line_number);
      section_ = Section::kNodes;
    } else if (keyword.name == "element") {
      refuse_outside_data(keyword, line_number);
      begin_elements(keyword, line_number);
    } else if (keyword.name == "part") {
      if (++part_ == kMostParts) file_.fail_at(line_number, "the file has too many parts");
    } else if (keyword.name == "instance") {
      ++instances_;
    } else if (keyword.name == "include") {
      file_.fail_at(line_number, "*INCLUDE is not supported; give one file",
                    ErrorCode::kUnsupported);
    } else if (keyword.name == "ngen" || keyword.name == "elgen" || keyword.name == "ncopy" ||
               keyword.name == "elcopy") {
      file_.fail_at(line_number,
                    "generated nodes and elements (*" + keyword.name + ") are not supported",
                    ErrorCode::kUnsupported);
    } else if (materials_.begin(keyword, part_)) {
      refuse_outside_data(keyword, line_number);
      section_ = Section::kMaterials;
    }
  }

  void read_material_data() {
    std::string_view line;
    file_.next_line(line);
    materials_.data(line);
  }

  void refuse_outside_data(const AbaqusKeyword& keyword, std::int64_t line) const {
    if (keyword.parameters.count("input")) {
      file_.fail_at(line, "data in another file (INPUT=) is not supported; give one file",
                    ErrorCode::kUnsupported);
    }
  }

  void begin_elements(const AbaqusKeyword& keyword, std::int64_t line) {
    const auto type = keyword.parameters.find("type");
    if (type == keyword.parameters.end() || type->second.empty())
      file_.fail_at(line, "*ELEMENT without TYPE");
    type_ = type->second;
    set_ = keyword.value("elset");
    std::string_view solid = type_;
    if (solid.substr(0, 1) == "d") solid.remove_prefix(1);  // heat transfer: DC3D4
    const std::string_view size =
        solid.substr(0, 3) == "c3d" ? solid.substr(3) : std::string_view();
    const std::size_t digits = size.find_first_not_of("0123456789");
    const std::string_view number = size.substr(0, digits);
    nodes_per_tet_ = number == "4" ? 4 : number == "10" ? 10 : 0;
    section_ = nodes_per_tet_ > 0 ? Section::kTets : Section::kOtherElements;
  }

  /// Labels of different parts may be equal: the part goes into the upper bits, of which there are
  /// 23.
  static constexpr std::int64_t kMostParts = 1 << 22;
  std::int64_t scoped(std::int64_t label) const {
    if (label < 0 || label >= kPartStride)
      file_.fail("an id is out of range: " + std::to_string(label));
    return label + part_ * kPartStride;
  }

  void read_node() {
    const std::int64_t label = scoped(file_.integer("a node id"));
    const double x = file_.real_in_line("coordinate x");
    const double y = file_.real_in_line("coordinate y");
    const double z = file_.real_in_line("coordinate z");
    builder_.add_node(label, x, y, z);
    file_.skip_line();
  }

  void read_tet() {
    const std::int64_t line = file_.line();
    const std::int64_t label = scoped(file_.integer("an element id"));
    std::array<std::int64_t, 4> nodes{};
    for (std::int64_t& node : nodes) node = scoped(file_.integer_in_line("a node id"));
    if (nodes_per_tet_ > 4) {
      // Data of one element may run over several lines.
      for (int i = 4; i < nodes_per_tet_; ++i) static_cast<void>(file_.integer("a node id"));
      builder_.count_curved_tet();
    }
    builder_.add_tet(label, nodes, line);
    materials_.put(set_, part_, label - part_ * kPartStride);
    file_.skip_line();
  }

  void skip_element() {
    std::string_view line;
    do {
      if (!file_.next_line(line)) break;
      line = trim(line);
    } while (!line.empty() && line.back() == ',');
    builder_.ignore_cell(type_);
  }

  TextCursor& file_;
  MeshBuilder builder_;
  Section section_ = Section::kOther;
  AbaqusMaterials materials_;
  std::string type_, set_;
  int nodes_per_tet_ = 0;
  std::int64_t part_ = 0;
  int instances_ = 0;
};

}  // namespace

MeshReading read_abaqus(TextCursor& file) { return AbaqusReader(file).read(); }

}  // namespace limber::scene::formats
