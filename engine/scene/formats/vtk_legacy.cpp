// Legacy VTK files (.vtk), unstructured grids, ASCII and binary (big-endian), cell arrays as before
// and since version 5.
#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/readers.h"
#include "engine/scene/formats/vtk_cells.h"

namespace limber::scene::formats {
namespace {

class VtkLegacyReader {
 public:
  explicit VtkLegacyReader(TextCursor& file) : file_(file), builder_(file) {}

  MeshReading read() {
    read_header();
    // Data follow the three sections.
    while (!(points_ && cells_read_ && types_) && file_.skip_blanks()) {
      const std::int64_t line = file_.line();
      const std::string keyword(file_.word());
      if (same_word(keyword, "POINTS")) {
        read_points();
      } else if (same_word(keyword, "CELLS")) {
        read_cells();
      } else if (same_word(keyword, "CELL_TYPES")) {
        read_types();
      } else if (same_word(keyword, "FIELD")) {
        skip_field();
      } else if (same_word(keyword, "METADATA")) {
        skip_metadata();
      } else {
        file_.fail_at(line, "expected POINTS, CELLS, CELL_TYPES, FIELD or METADATA, found " +
                                in_quotes(keyword));
      }
    }
    if (!points_ || !cells_read_ || !types_)
      file_.fail("the file ends before POINTS, CELLS and CELL_TYPES are given");
    if (cells_.types.size() != cells_.ends.size()) {
      file_.fail(std::to_string(cells_.ends.size()) + " cells but " +
                 std::to_string(cells_.types.size()) + " cell types");
    }
    read_cell_data();
    add_vtk_cells(cells_, 0, static_cast<std::int64_t>(builder_.node_count()), file_, builder_);
    warn_of_cell_data(unread_, builder_);
    return builder_.finish();
  }

 private:
  /// A file whose data cannot be read is a mesh all the same.
  void read_cell_data() {
    std::string_view line;
    try {
      while (file_.next_line(line)) {
        constexpr std::string_view kKeyword = "CELL_DATA";
        if (!same_word(line.substr(0, kKeyword.size()), kKeyword)) continue;
        while (read_attribute()) {
        }
        return;
      }
    } catch (const Error& error) {
      builder_.warn(std::string("the cell data are read as far as possible: ") + error.what());
    }
  }

  /// One array, or several of a FIELD. False at the end of the cell data.
  bool read_attribute() {
    if (!file_.skip_blanks()) return false;
    const std::string keyword = to_lower(file_.word());
    const auto cells = static_cast<std::int64_t>(cells_.types.size());
    if (keyword == "point_data") return false;
    if (keyword == "metadata") {
      skip_metadata();
      return true;
    }
    const std::string name(file_.word());
    if (keyword == "field") {
      const std::int64_t arrays = file_.count("a number of arrays", 8);
      for (std::int64_t i = 0; i < arrays; ++i) {
        if (!file_.skip_blanks()) file_.fail("the file ends inside a FIELD");
        const std::string array(file_.word());
        const std::int64_t components = file_.count("a number of components", 1);
        const std::int64_t tuples = file_.count("a number of tuples", 1);
        read_values(array, std::string(file_.word()), components, tuples);
      }
      return true;
    }
    if (keyword == "scalars") {
      const std::string type(file_.word());
      const std::int64_t components =
          file_.skip_blanks_in_line() ? file_.count("a number of components", 1) : 1;
      file_.expect("LOOKUP_TABLE");
      file_.word();
      read_values(name, type, components, cells);
      return true;
    }
    static constexpr std::pair<const char*, int> kSizes[] = {
        {"vectors", 3},  {"normals", 3},    {"tensors", 9},
        {"tensors6", 6}, {"global_ids", 1}, {"pedigree_ids", 1}};
    for (const auto& [word, size] : kSizes) {
      if (keyword != word) continue;
      read_values(name, std::string(file_.word()), size, cells);
      return true;
    }
    file_.fail("the attribute " + in_quotes(keyword) + " is not known");
  }

  /// Keeps a number for each cell under a name that is known, and passes over all else.
  void read_values(const std::string& name, const std::string& type, std::int64_t components,
                   std::int64_t tuples) {
    const std::string key = to_lower(name);
    file_.skip_line();
    file_.check_count(components, "a number of components", 1);
    file_.check_count(components * tuples, "the size of an array", 1);
    const bool is_kept = is_read_cell_data(key) && components == 1 &&
                         tuples == static_cast<std::int64_t>(cells_.types.size());
    if (!is_kept) unread_.push_back(key);
    std::vector<double> values;
    const auto count = static_cast<std::size_t>(components * tuples);
    if (!binary_) {
      for (std::size_t i = 0; i < count; ++i) {
        if (is_kept) {
          values.push_back(file_.real("a value of a cell"));
        } else {
          file_.word();
        }
      }
    } else {
      const std::size_t size = size_of(type);
      const char* at = file_.bytes(count * size, "an array").data();
      for (std::size_t i = 0; is_kept && i < count; ++i, at += size)
        values.push_back(number_at(at, type, size));
    }
    if (is_kept) cells_.data[key] = std::move(values);
  }

  static double number_at(const char* at, const std::string& type, std::size_t size) {
    if (same_word(type, "float")) return decode<float>(at, ByteOrder::kBig);
    if (same_word(type, "double")) return decode<double>(at, ByteOrder::kBig);
    const std::string known = to_lower(type);
    if (known.starts_with("unsigned_") || known == "vtktypeuint64")
      return whole_at<std::uint64_t, std::uint32_t, std::uint16_t, std::uint8_t>(at, size);
    return whole_at<std::int64_t, std::int32_t, std::int16_t, std::int8_t>(at, size);
  }

  template <class Of8, class Of4, class Of2, class Of1>
  static double whole_at(const char* at, std::size_t size) {
    if (size == 8) return static_cast<double>(decode<Of8>(at, ByteOrder::kBig));
    if (size == 4) return decode<Of4>(at, ByteOrder::kBig);
    if (size == 2) return decode<Of2>(at, ByteOrder::kBig);
    return decode<Of1>(at, ByteOrder::kBig);
  }

  void read_header() {
    std::string_view line;
    file_.next_line(line);
    constexpr std::string_view kMagic = "# vtk DataFile Version ";
    if (line.substr(0, kMagic.size()) != kMagic)
      file_.fail_at(1, "expected '# vtk DataFile Version'");
    file_.skip_line();  // title
    const std::string encoding(file_.word());
    binary_ = same_word(encoding, "BINARY");
    if (!binary_ && !same_word(encoding, "ASCII"))
      file_.fail("expected ASCII or BINARY, found " + in_quotes(encoding));
    const std::string dataset(file_.word());
    const std::string kind(file_.word());
    if (!same_word(dataset, "DATASET")) file_.fail("expected DATASET, found " + in_quotes(dataset));
    if (!same_word(kind, "UNSTRUCTURED_GRID")) {
      file_.fail_at(file_.line(),
                    "a dataset of kind " + in_quotes(kind) + "; UNSTRUCTURED_GRID is read",
                    ErrorCode::kUnsupported);
    }
  }

  /// Bytes of one number in a binary file.
  std::size_t size_of(std::string_view type) const {
    static constexpr std::pair<const char*, std::size_t> kSizes[] = {
        {"char", 1},          {"unsigned_char", 1}, {"short", 2},        {"unsigned_short", 2},
        {"int", 4},           {"unsigned_int", 4},  {"float", 4},        {"long", 8},
        {"unsigned_long", 8}, {"double", 8},        {"vtktypeint64", 8}, {"vtktypeuint64", 8},
        {"vtkidtype", 4},
    };
    for (const auto& [name, size] : kSizes) {
      if (same_word(type, name)) return size;
    }
    file_.fail_at(file_.line(), "the data type " + in_quotes(type) + " is not supported",
                  ErrorCode::kUnsupported);
  }

  /// Reads `count` whole numbers of `size` bytes (or as text).
  std::vector<std::int64_t> integers(std::int64_t count, std::size_t size, const char* what) {
    std::vector<std::int64_t> result(static_cast<std::size_t>(count));
    if (!binary_) {
      for (std::int64_t& value : result) value = file_.integer(what);
      return result;
    }
    const char* at = file_.bytes(result.size() * size, what).data();
    for (std::int64_t& value : result) {
      value = size == 8 ? decode<std::int64_t>(at, ByteOrder::kBig)
                        : decode<std::int32_t>(at, ByteOrder::kBig);
      at += size;
    }
    return result;
  }

  void read_points() {
    if (points_) file_.fail("POINTS are given twice");
    points_ = true;
    const std::int64_t count = file_.integer("the number of points");
    const std::string type(file_.word());
    const std::size_t size = size_of(type);
    file_.check_count(count, "the number of points", binary_ ? 3 * size : 6);
    builder_.reserve_nodes(count);
    if (!binary_) {
      for (std::int64_t i = 0; i < count; ++i) {
        const double x = file_.real("coordinate x");
        const double y = file_.real("coordinate y");
        const double z = file_.real("coordinate z");
        builder_.add_node(i, x, y, z);
      }
      return;
    }
    const bool is_float = same_word(type, "float");
    if (!is_float && !same_word(type, "double")) {
      file_.fail_at(file_.line(), "binary points of type " + in_quotes(type) + " are not supported",
                    ErrorCode::kUnsupported);
    }
    file_.skip_line();
    const char* at = file_.bytes(static_cast<std::size_t>(count) * 3 * size, "the points").data();
    const auto next = [&] {
      const double value = is_float ? static_cast<double>(decode<float>(at, ByteOrder::kBig))
                                    : decode<double>(at, ByteOrder::kBig);
      at += size;
      return value;
    };
    for (std::int64_t i = 0; i < count; ++i) {
      const double x = next();
      const double y = next();
      const double z = next();
      builder_.add_node(i, x, y, z);
    }
  }

  void read_cells() {
    if (cells_read_) file_.fail("CELLS are given twice");
    cells_read_ = true;
    const std::int64_t first = file_.integer("the number of cells");
    const std::int64_t second = file_.integer("the size of the cell list");
    file_.skip_line();
    if (first > 0 && file_.skip_blanks_in_line() && file_.peek() == 'O') {
      read_cells_version_5(first, second);
      return;
    }
    const std::size_t bytes = binary_ ? 4 : 2;
    file_.check_count(first, "the number of cells", bytes);
    file_.check_count(second, "the size of the cell list", bytes);
    const std::vector<std::int64_t> list = integers(second, 4, "a point of a cell");
    std::size_t at = 0;
    for (std::int64_t i = 0; i < first; ++i) {
      if (at >= list.size())
        file_.fail("the cell list ends before cell " + std::to_string(i) + " (from 0)");
      const std::int64_t points = list[at++];
      if (points < 0 || static_cast<std::uint64_t>(points) > list.size() - at) {
        file_.fail("cell " + std::to_string(i) + " (from 0) has " + std::to_string(points) +
                   " points, more than the cell list holds");
      }
      for (std::int64_t p = 0; p < points; ++p) cells_.connectivity.push_back(list[at++]);
      cells_.ends.push_back(static_cast<std::int64_t>(cells_.connectivity.size()));
    }
  }

  void read_cells_version_5(std::int64_t offset_count, std::int64_t connectivity_count) {
    file_.expect("OFFSETS");
    const std::size_t offset_size = size_of(file_.word());
    file_.skip_line();
    if (offset_size < 4) file_.fail("offsets are of a type that is too small");
    file_.check_count(offset_count, "the number of offsets", binary_ ? offset_size : 2);
    std::vector<std::int64_t> offsets = integers(offset_count, offset_size, "an offset");
    if (offsets.front() != 0) file_.fail("the first offset is not 0");
    cells_.ends.assign(offsets.begin() + 1, offsets.end());
    file_.expect("CONNECTIVITY");
    const std::size_t size = size_of(file_.word());
    file_.skip_line();
    if (size < 4) file_.fail("the connectivity is of a type that is too small");
    file_.check_count(connectivity_count, "the size of the connectivity", binary_ ? size : 2);
    cells_.connectivity = integers(connectivity_count, size, "a point of a cell");
  }

  void read_types() {
    if (types_) file_.fail("CELL_TYPES are given twice");
    types_ = true;
    const std::int64_t count = file_.count("the number of cell types", binary_ ? 4 : 2);
    file_.skip_line();
    cells_.types = integers(count, 4, "a cell type");
  }

  void skip_field() {
    file_.word();  // the name of the field
    const std::int64_t arrays = file_.integer("a number of arrays");
    for (std::int64_t i = 0; i < arrays; ++i) {
      if (!file_.skip_blanks()) file_.fail("the file ends inside a FIELD");
      file_.word();
      const std::int64_t components = file_.count("a number of components", 1);
      const std::int64_t tuples = file_.count("a number of tuples", 1);
      const std::string type(file_.word());
      file_.skip_line();
      file_.check_count(components * tuples, "the size of an array", 1);
      if (binary_) {
        file_.bytes(static_cast<std::size_t>(components * tuples) * size_of(type), "a FIELD");
      } else {
        for (std::int64_t n = 0; n < components * tuples; ++n) file_.word();
      }
    }
  }

  /// METADATA run to the next empty line.
  void skip_metadata() {
    file_.skip_line();
    std::string_view line;
    while (file_.next_line(line) && !trim(line).empty()) {
    }
  }

  TextCursor& file_;
  MeshBuilder builder_;
  VtkCells cells_;
  std::vector<std::string> unread_;
  bool binary_ = false;
  bool points_ = false;
  bool cells_read_ = false;
  bool types_ = false;
};

}  // namespace

MeshReading read_vtk_legacy(TextCursor& file) { return VtkLegacyReader(file).read(); }

}  // namespace limber::scene::formats
