#include "engine/scene/formats/ply_file.h"

#include <cstdint>
#include <utility>

#include "engine/base/checked_number.h"

namespace limber::scene::formats {
namespace {

std::size_t bytes_of_type(PlyType type) {
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

}  // namespace

void PlyFile::check_count(const PlyElement& element) const {
  file_.check_count(element.count, "the number of elements",
                    element.properties.empty() ? 1 : least_bytes(element));
}

std::size_t PlyFile::least_bytes(const PlyElement& element) const {
  std::size_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    bytes += text_ ? 2 : bytes_of_type(property.list ? property.count_type : property.type);
  }
  return bytes;
}

PlyType PlyFile::type_named(std::string_view name) const {
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

void PlyFile::read_header() {
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
      read_property_line(line);
    } else if (keyword != "comment" && keyword != "obj_info") {
      file_.fail_at(line, "the keyword " + in_quotes(keyword) + " is not known");
    }
    file_.skip_line();
  }
  if (!format) file_.fail("the header has no format");
}

void PlyFile::read_property_line(std::int64_t line) {
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
}

void PlyFile::read_format(std::string_view format) {
  text_ = format == "ascii";
  order_ = format == "binary_big_endian" ? ByteOrder::kBig : ByteOrder::kLittle;
  if (!text_ && format != "binary_little_endian" && format != "binary_big_endian") {
    file_.fail("the format " + in_quotes(format) + " is not known");
  }
}

double PlyFile::number(PlyType type) {
  if (text_) return file_.real("a number");
  const char* const at = file_.bytes(bytes_of_type(type), "a number").data();
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

const std::vector<double>& PlyFile::read(const PlyProperty& property) {
  values_.clear();
  std::int64_t count = 1;
  if (property.list) {
    const auto claimed = to_whole<int>(number(property.count_type));
    if (!claimed || *claimed < 0) file_.fail("a list of wrong length");
    count = *claimed;
    file_.check_count(count, "the length of a list", text_ ? 2 : bytes_of_type(property.type));
  }
  for (std::int64_t i = 0; i < count; ++i) values_.push_back(number(property.type));
  return values_;
}

}  // namespace limber::scene::formats
