#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

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

/// A Stanford .ply: reads its header at once, then the data property by property in their order,
/// from text or bytes.
class PlyFile {
 public:
  /// @throws Error through `file`, as all that follows
  explicit PlyFile(TextCursor& file) : file_(file) { read_header(); }

  [[nodiscard]] const std::vector<PlyElement>& elements() const { return elements_; }
  /// Before the first of an element's rows: refuses a count that the file cannot hold.
  void check_count(const PlyElement& element) const;
  /// The values of the next property: one, or those of a list. Valid until the next call.
  const std::vector<double>& read(const PlyProperty& property);

 private:
  [[nodiscard]] std::size_t least_bytes(const PlyElement& element) const;
  [[nodiscard]] PlyType type_named(std::string_view name) const;
  void read_header();
  void read_format(std::string_view format);
  void read_property_line(std::int64_t line);
  double number(PlyType type);

  TextCursor& file_;
  std::vector<PlyElement> elements_;
  std::vector<double> values_;
  bool text_ = true;
  ByteOrder order_ = ByteOrder::kLittle;
};

}  // namespace limber::scene::formats
