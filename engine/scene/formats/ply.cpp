// Stanford .ply: a header that describes elements and their properties, then the data as text or
// bytes.
#include <cmath>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
namespace {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  bool list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat:
      return 4;
    case PlyType::kDouble:
      return 8;
  }
  return 8;
}

class PlyReader {
 public:
  explicit PlyReader(TextCursor& file) : file_(file) {}

  TriangleSurface read() {
    read_header();
    for (const PlyElement& element : elements_) {
      file_.check_count(element.count, "the number of elements",
                        element.properties.empty() ? 1 : least_bytes(element));
      for (std::int64_t i = 0; i < element.count; ++i) {
        if (element.name == "vertex") {
          read_vertex(element);
        } else if (element.name == "face") {
          read_face(element);
        } else {
          for (const PlyProperty& property : element.properties) read_property(property);
        }
      }
    }
    return builder_.finish(file_);
  }

 private:
  std::size_t least_bytes(const PlyElement& element) const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
      bytes += text_ ? 2 : size_of(property.list ? property.count_type : property.type);
    }
    return bytes;
  }

  PlyType type_named(std::string_view name) const {
    static constexpr std::pair<const char*, PlyType> kTypes[] = {
        {"char", PlyType::kInt8},      {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
        {"uint8", PlyType::kUint8},    {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
        {"ushort", PlyType::kUint16},  {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
        {"int32", PlyType::kInt32},    {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
        {"float", PlyType::kFloat},    {"float32", PlyType::kFloat}, {"double", PlyType::kDouble},
        {"float64", PlyType::kDouble},
    };
    for (const auto& [text, type] : kTypes) {
      if (name == text) return type;
    }
    file_.fail("the property type " + in_quotes(name) + " is not known");
  }

  void read_header() {
    file_.expect("ply");
    file_.skip_line();
    bool format = false;
    for (;;) {
      if (!file_.skip_blanks()) file_.fail("the header does not end");
      const std::int64_t line = file_.line();
      const std::string_view keyword = file_.word();
      if (keyword == "end_header") {
        file_.skip_line();
        break;
      }
      if (keyword == "format") {
        read_format(file_.word());
        format = true;
      } else if (keyword == "element") {
        PlyElement element;
        element.name = std::string(file_.word());
        element.count = file_.integer_in_line("a number of elements");
        elements_.push_back(std::move(element));
      } else if (keyword == "property") {
        if (elements_.empty()) file_.fail_at(line, "a property before any element");
        PlyProperty property;
        std::string_view type = file_.word();
        if (type == "list") {
          property.list = true;
          property.count_type = type_named(file_.word());
          type = file_.word();
        }
        property.type = type_named(type);
        property.name = std::string(file_.word());
        elements_.back().properties.push_back(std::move(property));
      } else if (keyword != "comment" && keyword != "obj_info") {
        file_.fail_at(line, "the keyword " + in_quotes(keyword) + " is not known");
      }
      file_.skip_line();
    }
    if (!format) file_.fail("the header has no format");
  }

  void read_format(std::string_view format) {
    text_ = format == "ascii";
    order_ = format == "binary_big_endian" ? ByteOrder::kBig : ByteOrder::kLittle;
    if (!text_ && format != "binary_little_endian" && format != "binary_big_endian") {
      file_.fail("the format " + in_quotes(format) + " is not known");
    }
  }

  double number(PlyType type) {
    if (text_) return file_.real("a number");
    const char* const at = file_.bytes(size_of(type), "a number").data();
    switch (type) {
      case PlyType::kInt8:
        return decode<std::int8_t>(at, order_);
      case PlyType::kUint8:
        return decode<std::uint8_t>(at, order_);
      case PlyType::kInt16:
        return decode<std::int16_t>(at, order_);
      case PlyType::kUint16:
        return decode<std::uint16_t>(at, order_);
      case PlyType::kInt32:
        return decode<std::int32_t>(at, order_);
      case PlyType::kUint32:
        return decode<std::uint32_t>(at, order_);
      case PlyType::kFloat:
        return static_cast<double>(decode<float>(at, order_));
      case PlyType::kDouble:
        return decode<double>(at, order_);
    }
    return 0;
  }

  /// The values of a property: one, or those of a list, in `values_`.
  void read_property(const PlyProperty& property) {
    values_.clear();
    std::int64_t count = 1;
    if (property.list) {
      const double claimed = number(property.count_type);
      if (!(claimed >= 0 && claimed <= 2e9)) file_.fail("a list of wrong length");
      count = static_cast<std::int64_t>(claimed);
      file_.check_count(count, "the length of a list", text_ ? 2 : size_of(property.type));
    }
    for (std::int64_t i = 0; i < count; ++i) values_.push_back(number(property.type));
  }

  void read_vertex(const PlyElement& element) {
    double at[3] = {0, 0, 0};
    int found = 0;
    for (const PlyProperty& property : element.properties) {
      read_property(property);
      for (int axis = 0; axis < 3; ++axis) {
        if (property.list || property.name != std::string(1, "xyz"[axis])) continue;
        at[axis] = values_[0];
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
      read_property(property);
      if (!property.list || (property.name != "vertex_indices" && property.name != "vertex_index"))
        continue;
      std::vector<std::int64_t> corners;
      for (const double value : values_) {
        if (!(std::abs(value) < 9e15)) file_.fail("a vertex index that is no number");
        corners.push_back(static_cast<std::int64_t>(value));
      }
      if (!builder_.add_polygon(corners, file_.line()))
        file_.fail("a face of fewer than three vertices");
    }
  }

  TextCursor& file_;
  SurfaceBuilder builder_;
  std::vector<PlyElement> elements_;
  std::vector<double> values_;
  bool text_ = true;
  ByteOrder order_ = ByteOrder::kLittle;
};

}  // namespace

TriangleSurface read_ply(TextCursor& file) { return PlyReader(file).read(); }

}  // namespace limber::scene::formats
