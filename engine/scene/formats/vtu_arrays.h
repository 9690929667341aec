#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/formats/byte_reader.h"
#include "engine/scene/formats/text_cursor.h"

namespace pugi {
class xml_node;
}

namespace limber::scene::formats {

/// How a VTK XML file keeps its arrays
/// (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html).
struct VtuEncoding {
  ByteOrder order = ByteOrder::kLittle;
  std::size_t header_bytes = 4;  // of the counts before binary data: UInt32 or UInt64
  bool zlib = false;
  bool appended_base64 = false;
  std::string_view appended;  // what follows the '_' of AppendedData
};

/// Memory limit for all arrays of a file: compressed or named many times, a small file can claim
/// any size.
class ArrayBudget {
 public:
  explicit ArrayBudget(std::size_t bytes) : bytes_(bytes), left_(bytes) {}
  /// To be called before memory is taken.
  /// @throws Error{kLimitExceeded} through `file` if more is requested than remains
  void take(std::uint64_t bytes, const TextCursor& file);

 private:
  std::size_t bytes_, left_;
};

/// All numbers of a <DataArray>, from any of its encodings: ascii, inline base64, appended raw or
/// base64, zlib or not.
/// @param budget  the numbers and their decoded bytes are taken from it
/// @throws Error through `file` for broken encodings, {kUnsupported} for unknown types,
/// {kLimitExceeded} beyond the budget.
[[nodiscard]] std::vector<double> read_real_array(const pugi::xml_node& array,
                                                  const VtuEncoding& encoding,
                                                  const TextCursor& file, ArrayBudget& budget);
[[nodiscard]] std::vector<std::int64_t> read_integer_array(const pugi::xml_node& array,
                                                           const VtuEncoding& encoding,
                                                           const TextCursor& file,
                                                           ArrayBudget& budget);

}  // namespace limber::scene::formats
