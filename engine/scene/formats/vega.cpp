// VegaFEM .veg: sections that begin with a star; sets of elements, materials, and regions that give
// a set a material.
#include "engine/scene/formats/material_table.h"
#include "engine/scene/formats/mesh_builder.h"
#include "engine/scene/formats/readers.h"

namespace limber::scene::formats {
namespace {

std::string file_name(std::string_view path) {
  const std::size_t folder = path.find_last_of("/\\");
  return std::string(folder == std::string_view::npos ? path : path.substr(folder + 1));
}

/// VegaFEM's names may be compared only exactly, keywords in any case.
class VegaReader {
 public:
  VegaReader(TextCursor& file, const Companions& companions)
      : file_(file), companions_(companions), builder_(file) {
    prepare(file_);
  }

  MeshReading read() {
    read_sections(file_);
    MaterialTable table = assigned_materials();
    MeshReading result = builder_.finish();
    table.store(result);
    return result;
  }

 private:
  enum class Section { kNone, kVertices, kElements, kSet, kMaterial, kRegion, kOther };
  struct Region {
    std::string set;
    std::string material;
    std::int64_t line;
  };

  static void prepare(TextCursor& file) {
    file.set_comment('#');
    file.set_comma_separates(true);
  }

  void read_sections(TextCursor& text) {
    while (text.skip_blanks()) {
      if (text.peek() == '*') {
        begin_section(text);
        continue;
      }
      switch (section_) {
        case Section::kNone:
          text.fail("expected a section such as *VERTICES");
        case Section::kVertices:
          read_vertex(text);
          break;
        case Section::kElements:
          read_element(text);
          break;
        case Section::kSet:
          sets_[name_].push_back(text.integer("an element number"));
          break;
        case Section::kMaterial:
          read_material(text);
          break;
        case Section::kRegion:
          read_region(text);
          break;
        case Section::kOther:
          text.skip_line();
          break;
      }
    }
  }

  void begin_section(TextCursor& text) {
    const std::int64_t line = text.line();
    const std::string keyword(text.word());
    if (same_word(keyword, "*INCLUDE")) {
      include(text, line);
      return;
    }
    if (same_word(keyword, "*VERTICES")) {
      section_ = Section::kVertices;
      header_read_ = false;
    } else if (same_word(keyword, "*ELEMENTS")) {
      section_ = Section::kElements;
      header_read_ = false;
    } else if (same_word(keyword, "*SET") || same_word(keyword, "*MATERIAL")) {
      section_ = same_word(keyword, "*SET") ? Section::kSet : Section::kMaterial;
      name_ = text.skip_blanks_in_line() ? std::string(text.word()) : std::string();
      if (name_.empty()) text.fail_at(line, keyword + " without a name");
      if (section_ == Section::kSet) sets_[name_];
    } else if (same_word(keyword, "*REGION")) {
      section_ = Section::kRegion;
    } else {
      section_ = Section::kOther;
    }
  }

  void include(TextCursor& text, std::int64_t line) {
    const std::string name = text.skip_blanks_in_line() ? file_name(text.word()) : std::string();
    const auto companion = companions_.find(name);
    if (companion == companions_.end()) {
      builder_.warn(
          "the file " + in_quotes(name) + " (*INCLUDE in line " + std::to_string(line) +
          ") is not there" +
          (section_ == Section::kSet ? "; the set " + in_quotes(name_) + " lacks it" : ""));
      return;
    }
    // Files that include each other, even a few levels deep, could be read for ever.
    if (++depth_ > 8 || ++includes_ > 1000) {
      text.fail_at(line, "*INCLUDE is nested too deeply or used too often");
    }
    // Each time that a file is read its numbers are stored again.
    included_bytes_ += companion->second.size();
    if (included_bytes_ > most_included_bytes()) {
      throw Error(ErrorCode::kLimitExceeded, text.name(),
                  text.name() + ":" + std::to_string(line) + ": with " + in_quotes(name) +
                      ", *INCLUDE lines read " + std::to_string(included_bytes_) +
                      " bytes, more than twice the included files; include each file once");
    }
    TextCursor inner(name, companion->second);
    prepare(inner);
    read_sections(inner);
    --depth_;
  }

  /// A small file may be included as often as it likes.
  [[nodiscard]] std::size_t most_included_bytes() const {
    std::size_t bytes = 1 << 20;
    for (const auto& companion : companions_) bytes += 2 * companion.second.size();
    return bytes;
  }

  void read_vertex(TextCursor& text) {
    if (!header_read_) {
      const std::int64_t count = text.count("the number of vertices", 8);
      builder_.reserve_nodes(count);
      text.skip_line();  // dimension and two zeros
      header_read_ = true;
      return;
    }
    const std::int64_t label = text.integer("a vertex number");
    const double x = text.real_in_line("coordinate x");
    const double y = text.real_in_line("coordinate y");
    const double z = text.real_in_line("coordinate z");
    builder_.add_node(label, x, y, z);
    text.skip_line();
  }

  void read_element(TextCursor& text) {
    if (!header_read_) {
      element_kind_ = std::string(text.word());
      is_tet_ = same_word(element_kind_, "TET") || same_word(element_kind_, "TETS");
      builder_.reserve_tets(text.count("the number of elements", 4));
      text.skip_line();
      header_read_ = true;
      return;
    }
    const std::int64_t label = text.integer("an element number");
    if (!is_tet_) {
      builder_.ignore_cell(to_lower(element_kind_) + " elements");
      text.skip_line();
      return;
    }
    std::array<std::int64_t, 4> nodes{};
    for (std::int64_t& node : nodes) node = text.integer_in_line("a vertex number");
    builder_.add_tet(label, nodes, text.line());
    text.skip_line();
  }

  void read_material(TextCursor& text) {
    const std::int64_t line = text.line();
    const std::string kind(text.word());
    bodies::Material material;
    if (same_word(kind, "ENU")) {
      material.density = text.real_in_line("a density");
      material.youngs_modulus = text.real_in_line("Young's modulus");
      material.poissons_ratio = text.real_in_line("Poisson's ratio");
    } else {
      // Orthotropic and Mooney-Rivlin materials have no counterpart here.
      builder_.warn("material " + in_quotes(name_) + " (line " + std::to_string(line) +
                    ") is of kind " + in_quotes(kind) + " and is ignored; ENU is read");
      text.skip_line();
      return;
    }
    if (materials_.count(name_))
      text.fail_at(line, "material " + in_quotes(name_) + " is given twice");
    materials_[name_] = material;
    text.skip_line();
  }

  void read_region(TextCursor& text) {
    Region region;
    region.line = text.line();
    region.set = std::string(text.word());
    region.material = text.skip_blanks_in_line() ? std::string(text.word()) : std::string();
    if (region.material.empty()) text.fail("expected 'set, material' in *REGION");
    regions_.push_back(region);
    text.skip_line();
  }

  MaterialTable assigned_materials() {
    MaterialTable table(builder_.tet_count());
    LabelMap elements;
    for (std::size_t t = 0; t < builder_.tet_count(); ++t) elements.add(builder_.tet_label(t));
    if (elements.seal() >= 0) file_.fail("an element number is given twice");
    for (const Region& region : regions_) {
      const auto material = materials_.find(region.material);
      if (material == materials_.end()) continue;  // of a kind that is not read, and warned of
      const int index = table.add_material(material->second);
      if (region.set == "allElements") {
        table.assign_unassigned(index);
        continue;
      }
      const auto set = sets_.find(region.set);
      if (set == sets_.end())
        file_.fail_at(region.line, "the set " + in_quotes(region.set) + " is not defined");
      for (const std::int64_t label : set->second) {
        const int tet = elements.find(label);
        if (tet < 0) {
          file_.fail_at(region.line, "the set " + in_quotes(region.set) + " holds element " +
                                         std::to_string(label) +
                                         ", which the file does not define");
        }
        table.assign(tet, index);  // a later region wins, as in VegaFEM
      }
    }
    return table;
  }

  TextCursor& file_;
  const Companions& companions_;
  MeshBuilder builder_;
  Section section_ = Section::kNone;
  bool header_read_ = false;
  bool is_tet_ = false;
  int depth_ = 0;
  int includes_ = 0;
  std::size_t included_bytes_ = 0;
  std::string element_kind_;
  std::string name_;
  std::map<std::string, std::vector<std::int64_t>> sets_;
  std::map<std::string, bodies::Material> materials_;
  std::vector<Region> regions_;
};

}  // namespace

MeshReading read_vega(TextCursor& file, const Companions& companions) {
  return VegaReader(file, companions).read();
}

std::vector<std::string> vega_includes(std::string_view content) {
  TextCursor text("", content);
  text.set_comment('#');
  std::vector<std::string> names;
  while (text.skip_blanks()) {
    if (text.peek() == '*' && same_word(text.word(), "*INCLUDE") && text.skip_blanks_in_line()) {
      names.push_back(file_name(text.word()));
    }
    text.skip_line();
  }
  return names;
}

}  // namespace limber::scene::formats
